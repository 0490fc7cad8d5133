#include "core/recursion/inverse/prescribed_motion.h"

#include "core/check_index.h"
#include "core/linear/dense.h"
#include "core/recursion/motion/postures.h"

namespace ffrobot::recursion {

ModalMotion modes_at(const std::vector<ModalShape> &shape, double t) {
  Index n = 0, k = 0;
  for (const ModalShape &of_body : shape)
    n += of_body.size();
  ModalMotion modes{VectorXd(n), VectorXd(n), VectorXd(n)};
  for (const ModalShape &of_body : shape)
    for (const TimeFunction &function : of_body) {
      const Jet jet = function(t);
      modes.p[k] = jet.value, modes.p_dot[k] = jet.rate, modes.p_ddot[k++] = jet.acceleration;
    }
  return modes;
}

namespace {

template <class Space> const VectorXd &checked(const DrivenMechanism<Space> &driven, const VectorXd &q) {
  const std::size_t equations = driven.mechanism.constraints.size(), joints = driven.of_joints.size();
  if (equations < joints)
    throw std::invalid_argument("rows: expected " + std::to_string(joints) +
                                ", as many as joints have coordinates, got " + std::to_string(equations));
  check_size("q", q.size(), driven.mechanism.n_q);
  return q;
}

} // namespace

template <class Space>
PrescribedMotion<Space>::PrescribedMotion(DrivenMechanism<Space> driven, const VectorXd &q)
    : driven_(std::move(driven)), space_(driven_.mechanism.n_v, driven_.mechanism.rotations),
      motion_(driven_.mechanism, driven_.scene, 0, checked(driven_, q).data(),
              VectorXd::Zero(driven_.mechanism.n_v).eval().data()),
      w_(driven_.mechanism), forces_(driven_.mechanism), sizes_(driven_.mechanism),
      state_(VectorXd::Zero(driven_.mechanism.n_q + driven_.mechanism.n_v)), a_(VectorXd::Zero(driven_.mechanism.n_v)),
      required_(a_), f_(a_), Q_(a_), step_(a_) {
  const Index equations = driven_.mechanism.constraints.size();
  int joint = 0;
  for (const auto &node : driven_.mechanism.nodes)
    for (int k = 0; k < node.shape.freedoms.count; ++k, ++joint)
      if (node.shape.freedoms.component[k] >= Space::linear)
        angles_.push_back(joint);
  for (const int v : driven_.of_modes)
    for (const auto &numbers : space_.numbers())
      if (v >= numbers.v && v < numbers.v + numbers.count)
        modes_in_q_.push_back(v + static_cast<int>(numbers.q - numbers.v));
  lambda_ = value_ = rate_ = VectorXd::Zero(equations);
  targets_.resize(driven_.mechanism.constraints.size());
  state_.head(q.size()) = q;
  if (!driven_.motors.empty())
    motors_.emplace(driven_);
}

template <class Space> void PrescribedMotion<Space>::start_at(const VectorXd &q) {
  state_.head(q.size()) = q;
  goes_on_ = false;
}

template <class Space> void PrescribedMotion<Space>::set_modes(const ModalMotion &modes) {
  state_(modes_in_q_) = modes.p;
  state_.tail(a_.size())(driven_.of_modes) = modes.p_dot;
  a_(driven_.of_modes) = modes.p_ddot;
}

template <class Space> void PrescribedMotion<Space>::measure() {
  recursion::measure(q(), v(), w_, value_.data(), rate_.data());
  take_off(targets_, driven_.mechanism.constraints, value_, rate_);
}

template <class Space> void PrescribedMotion<Space>::factorise() {
  factors_.compute(gradients(q(), w_)(Eigen::all, driven_.of_joints)); // C_J
}

template <class Space> void PrescribedMotion<Space>::go(double factor, const VectorXd &values) {
  step_(driven_.of_joints) = values;
  space_.integrate(q(), factor, step_.data(), state_.data());
}

template <class Space> bool PrescribedMotion<Space>::find_position() {
  constexpr double tolerance = 1e-15, floor = 1e-11; // second derivatives of splines through shapes are taken
  constexpr double largest_turn = 0.5;               // rad, of a step: keeps to the branch of the guess
  const auto off = [&] {
    measure();
    factorise();
    return sizes_.of_values(value_, q());
  };
  const auto step_on = [&] {
    const VectorXd step = -factors_.solve(value_);
    const double turn = angles_.empty() ? 0 : step(angles_).template lpNorm<Eigen::Infinity>();
    go(turn > largest_turn ? largest_turn / turn : 1, step);
  };
  return iterate_to_posture(tolerance, floor, off, step_on) <= floor;
}

template <class Space> bool PrescribedMotion<Space>::move(double t, const ModalMotion &modes) {
  return follow(t, modes, targets_at(driven_.scene, t));
}

template <class Space>
bool PrescribedMotion<Space>::follow(double t, const ModalMotion &modes, std::vector<Jet> targets) {
  targets_ = std::move(targets);
  auto v_all = state_.tail(a_.size());
  if (goes_on_)
    go(t - time_, v_all(driven_.of_joints));
  v_all(driven_.of_joints).setZero(), a_(driven_.of_joints).setZero();
  set_modes(modes);
  turn_markers(driven_.scene, t, w_);
  goes_on_ = true;
  time_ = t;
  if (!find_position())
    return false;
  v_all(driven_.of_joints) -= factors_.solve(rate_); // linear in v: exact in one step
  measure();
  act(t);
  forces_.accelerate(q(), a_.data(), w_);
  VectorXd bias(lambda_.size());
  for (std::size_t r = 0; r < targets_.size(); ++r)
    bias[r] = forces_.of_constraint(r, a_.data(), w_).value - targets_[r].acceleration;
  a_(driven_.of_joints) -= factors_.solve(bias);
  return a_.allFinite();
}

template <class Space> void PrescribedMotion<Space>::act(double t) {
  acting_ = motion_.act(t, q(), v());
  forces_.prepare(q(), v(), acting_.generalized, w_);
}

template <class Space>
void PrescribedMotion<Space>::take_joints(double t, const ModalMotion &modes, const PrescribedMotion &other) {
  targets_ = other.targets_;
  state_ = other.state_, a_ = other.a_;
  set_modes(modes);
  turn_markers(driven_.scene, t, w_);
  time_ = t;
  measure();
  factorise();
  act(t);
}

template <class Space> std::vector<Jet> PrescribedMotion<Space>::measured_in(const PrescribedMotion &other) {
  recursion::measure(other.q(), other.v(), w_, value_.data(), rate_.data());
  forces_.prepare(other.q(), other.v(), nullptr, w_);
  forces_.accelerate(other.q(), other.a_.data(), w_);
  std::vector<Jet> found;
  for (std::size_t r = 0; r < targets_.size(); ++r) {
    const Index i = r;
    found.push_back({value_[i], rate_[i], forces_.of_constraint(r, other.a_.data(), w_).value});
  }
  return found;
}

template <class Space> void PrescribedMotion<Space>::balance() {
  forces_.accelerate(q(), a_.data(), w_);
  forces_.leave_frames(w_);
  forces_.load(nullptr, acting_.wrench, w_);
  forces_.require(q(), a_.data(), w_, required_.data());
  for (const int i : driven_.of_joints)
    required_[i] -= acting_.generalized ? acting_.generalized[i] : 0;
  lambda_ = -factors_.solve_transposed(required_(driven_.of_joints));
  forces_.load(lambda_.data(), nullptr, w_);
  forces_.project(q(), w_, Q_.data()); // -C_v^T lambda
  f_ = required_ - Q_;
  std::copy_n(lambda_.data(), lambda_.size(), w_.lambda.data());
}

template <class Space> VectorXd PrescribedMotion<Space>::shape_force() const { return f_(driven_.of_modes); }

template <class Space> const Motors<Space> *PrescribedMotion<Space>::motors() {
  if (!motors_)
    return nullptr;
  motors_->split(q(), required_, w_);
  return &*motors_;
}

template <class Space> VectorXd PrescribedMotion<Space>::left() {
  const Motors<Space> *found = motors();
  return found ? found->left()(driven_.of_modes).eval() : shape_force();
}

template <class Space>
RedefinedMotion<Space>::RedefinedMotion(DrivenMechanism<Space> driven, DrivenMechanism<Space> path, const VectorXd &q,
                                        double factor, std::vector<TimeFunction> offset)
    : PrescribedMotion<Space>(std::move(driven), q), path_(std::move(path), q), factor_(factor),
      offset_(std::move(offset)) {
  const Index count = offset_.size();
  if (count != 0 && count != this->modes())
    throw std::invalid_argument("offset: expected " + std::to_string(this->modes()) +
                                " functions, one for each mode, or none, got " + std::to_string(count));
}

template <class Space> bool RedefinedMotion<Space>::move(double t, const ModalMotion &modes) {
  ModalMotion seen{factor_ * modes.p, factor_ * modes.p_dot, factor_ * modes.p_ddot};
  if (!offset_.empty()) {
    const ModalMotion more = modes_at({offset_}, t);
    seen.p += more.p, seen.p_dot += more.p_dot, seen.p_ddot += more.p_ddot;
  }
  if (!path_.move(t, seen))
    return false;
  const auto &driven = this->driven();
  if (&driven.mechanism == &path_.driven().mechanism) {
    this->take_joints(t, modes, path_);
    return true;
  }
  std::vector<Jet> targets = targets_at(driven.scene, t), motors = this->measured_in(path_);
  for (std::size_t r = 0; r < targets.size(); ++r)
    if (driven.is_path[r])
      targets[r] = motors[r];
  PrescribedMotion<Space>::start_at(path_.state().head(driven.mechanism.n_q));
  return this->follow(t, modes, std::move(targets));
}

// Of accelerations that the generalized forces (n_v) lead to, which are those of the motion, while the constraint
// equations `active` keep the second derivatives that they have.
template <class Space>
Derivatives PrescribedMotion<Space>::derivatives_under(const VectorXd &forces, const std::vector<int> &active) {
  VectorXd target(lambda_.size());
  for (Index r = 0; r < target.size(); ++r)
    target[r] = forces_.of_constraint(r, a_.data(), w_).value;
  w_.keep(active);
  return recursion::derivatives_under(driven_.scene, time_, state_, forces, target, w_);
}

// With all constraint equations C_ddot stays what it is: its derivatives at given a are -C_v a_q and -C_v a_v. Rows of
// a path that is followed are coordinates, whose C_v is constant.
template <class Space> JointSlopes PrescribedMotion<Space>::joint_slopes(const JointSlopes *followed) {
  VectorXd forces = VectorXd::Zero(a_.size());
  if (acting_.generalized)
    forces += Map<const VectorXd>(acting_.generalized, a_.size());
  forces(driven_.of_modes) += shape_force();
  const Derivatives found = derivatives_under(forces, motion_.workspace().active);
  const MatrixXd &C = found.value_q;
  const auto &joints = driven_.of_joints;
  JointSlopes to;
  to.q = to.v = to.a_p = to.a_v = MatrixXd::Zero(a_.size(), modes());
  to.q(driven_.of_modes, Eigen::all).setIdentity();
  const auto put = [&](MatrixXd rows, MatrixXd JointSlopes::*which) {
    for (Index r = 0; followed && r < rows.rows(); ++r)
      if (driven_.is_path[r])
        rows.row(r) += C.row(r) * followed->*which;
    (to.*which)(joints, Eigen::all) = factors_.solve(rows);
  };
  put(-C(Eigen::all, driven_.of_modes), &JointSlopes::q);
  put(-matrix_product(found.rate_q, to.q), &JointSlopes::v);
  put(matrix_product(C, matrix_product(found.a_v, to.q)), &JointSlopes::a_v);
  put(matrix_product(C, matrix_product(found.a_q, to.q) + matrix_product(found.a_v, to.v)), &JointSlopes::a_p);
  return to;
}

// M a - Q + C^T lambda = f leads to f_q = -(M a_q + C^T lambda_q) at given a and multipliers: those of loops with
// motors, else of all constraint equations. Without motors the joints' motion J by p, C J = 0, has the forces left as
// J^T f.
template <class Space> LeftSlopes PrescribedMotion<Space>::left_slopes(const JointSlopes &joints) {
  VectorXd forces = VectorXd::Zero(a_.size());
  if (acting_.generalized)
    forces += Map<const VectorXd>(acting_.generalized, a_.size());
  std::vector<int> active = motion_.workspace().active;
  if (const Motors<Space> *found = motors()) {
    forces(driven_.of_modes) += (found->left() - found->beside())(driven_.of_modes);
    for (std::size_t k = 0; k < driven_.motors.size(); ++k)
      forces[driven_.motors[k].coordinate] += driven_.motors[k].sign * found->tau()[k];
    std::erase_if(active, [&](int r) { return driven_.is_path[r]; });
  } else
    forces(driven_.of_modes) += shape_force();
  const auto shares_of = [&](const MatrixXd &of_forces) {
    if (motors_)
      return motors_->shares_of(of_forces);
    MatrixXd found = MatrixXd::Zero(modes(), modes());
    add_transposed_product(joints.q, of_forces, found);
    return found;
  };
  const Derivatives found = derivatives_under(forces, active);
  const MatrixXd M = mass_matrix(q(), forces_, w_);
  MatrixXd by_q = -matrix_product(M, found.a_q), by_v = -matrix_product(M, found.a_v);
  add_transposed_product(found.value_q, found.lambda_q, by_q, -1);
  add_transposed_product(found.value_q, found.lambda_v, by_v, -1);
  add_slopes(driven_.scene, q(), v(), by_q, by_v);
  return {shares_of(matrix_product(M, joints.q)),
          shares_of(matrix_product(by_v, joints.q) + matrix_product(M, joints.a_v)),
          shares_of(matrix_product(by_q, joints.q) + matrix_product(by_v, joints.v) + matrix_product(M, joints.a_p))};
}

template <class Space> LeftSlopes RedefinedMotion<Space>::slopes() {
  const auto &driven = this->driven();
  path_.balance();
  JointSlopes joints = path_.joint_slopes();
  for (MatrixXd *of : {&joints.q, &joints.v, &joints.a_p, &joints.a_v})
    (*of)(driven.of_joints, Eigen::all) *= factor_;
  return this->left_slopes(&driven.mechanism == &path_.driven().mechanism ? joints : this->joint_slopes(&joints));
}

template class PrescribedMotion<Planar>;
template class PrescribedMotion<Spatial>;
template class RedefinedMotion<Planar>;
template class RedefinedMotion<Spatial>;

} // namespace ffrobot::recursion
