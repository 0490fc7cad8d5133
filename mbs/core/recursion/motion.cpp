#include "core/recursion/motion.h"

#include "core/recursion/independent_rows.h"
#include "core/recursion/observe.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace ffrobot::recursion {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

constexpr double singular_ratio = 1e-6; // of Posture: below, joints cannot follow
constexpr double least_shift = 1e-8;    // of a state, relative: forces change by more than their rounding

// Of all rows; those without a target stay where they are.
std::vector<TimeFunction> laws_of(const Scene &scene, std::size_t rows) {
  std::vector<TimeFunction> laws;
  for (const Target &target : scene.targets)
    laws.push_back(target.law);
  laws.resize(rows, Constant(0));
  return laws;
}

VectorXd signs_of(const Scene &scene, std::size_t rows) {
  VectorXd signs = VectorXd::Ones(static_cast<Index>(rows));
  for (std::size_t r = 0; r < scene.targets.size(); ++r)
    signs[static_cast<Index>(r)] = scene.targets[r].sign;
  return signs;
}

} // namespace

Load::Load(const VectorXd &direction, TimeFunction magnitude_) : magnitude(std::move(magnitude_)) {
  for (Index i = 0; i < direction.size(); ++i)
    if (direction[i] != 0)
      along.emplace_back(static_cast<int>(i), direction[i]);
}

std::vector<Jet> targets_at(const Scene &scene, double t) {
  std::vector<Jet> found;
  for (const Target &target : scene.targets)
    found.push_back(target(t));
  return found;
}

template <class Space>
RecursiveMotion<Space>::RecursiveMotion(const Mechanism<Space> &mechanism, const Scene &scene, double t,
                                        const double *q, const double *v, const HeldForces *held, Steering *steering)
    : ImplicitSystem(ConfigurationSpace(mechanism.n_v, mechanism.rotations)), mechanism_(mechanism), scene_(scene),
      held_(held), steering_(steering), workspace_(mechanism), measured_(mechanism), newton_(mechanism),
      force_(VectorXd::Zero(mechanism.n_v)),
      wrench_(VectorXd::Zero(Space::dim * static_cast<Index>(mechanism.wrenches.size()))),
      along_cuts_(VectorXd::Zero(static_cast<Index>(scene.cut_joints.size()))),
      value_(VectorXd::Zero(static_cast<Index>(mechanism.rows.size()))), rate_(value_), correction_(force_),
      state_(VectorXd::Zero(mechanism.n_q + mechanism.n_v)), laws_(laws_of(scene, mechanism.rows.size())),
      sign_(signs_of(scene, mechanism.rows.size())), target_time_(std::numeric_limits<double>::quiet_NaN()),
      norm_(mechanism), shifted_(VectorXd::Zero(2 * mechanism.n_v)), unused_(VectorXd::Zero(mechanism.n_v)),
      evaluated_(VectorXd::Zero(mechanism.n_q)), rates_(force_), posture_(mechanism) {
  has_given_ = held_ || steering_ || !scene_.loads.empty() || !scene_.joint_forces.empty() || !scene_.gears.empty();
  has_wrenches_ =
      steering_ || !scene_.point_loads.empty() || !scene_.point_forces.empty() || !scene_.cut_joints.empty();
  update_targets(t);
  if (!scene.keeps_all_rows)
    keep_independent_rows(mechanism, q, v, workspace_);
  else if (!mechanism.rows.empty())
    evaluate(t, q, v, correction_.data()); // projections need its factors
  newton_.keep(workspace_.active);
  find_stiff_terms();
  if (scene.has_loops && !workspace_.active.empty()) {
    evaluate(t, q, v, correction_.data()); // with the factors of the rows that are kept
    loops_.emplace(mechanism, workspace_);
  }
  for (const GearSpring &gear : scene_.gears)
    for (const Node<Space> &node : mechanism.nodes)
      if (node.v == gear.a.v)
        norm_.add_spring(gear.stiffness, node.rotor_inertia * node.gear_ratio * node.gear_ratio);
  for (const Node<Space> &node : mechanism.nodes)
    for (int k = 0; k < node.n(); ++k)
      fastest_ = std::max(fastest_, std::sqrt(node.body.K[static_cast<std::size_t>(k)])), steps_between_postures_ = 10;
}

template <class Space> void RecursiveMotion<Space>::look_up(double t) {
  const auto begin = foreseen_times_.begin(), end = foreseen_times_.end();
  now_ = static_cast<std::size_t>(std::find(begin, end, t) - begin);
  if (now_ == foreseen_times_.size())
    find_laws(&t, 1), now_ = 0;
}

template <class Space> void RecursiveMotion<Space>::turn_markers(double t) {
  for (const DrivenMarker &driven : scene_.driven) {
    const auto i = static_cast<std::size_t>(driven.marker);
    workspace_.turning[i] = measured_.turning[i] = newton_.turning[i] = driven.law(t);
  }
}

template <class Space> void RecursiveMotion<Space>::foresee(const double *times, int count) {
  find_laws(times, count);
  if (steering_)
    steering_->foresee(times, count);
  target_time_ = std::numeric_limits<double>::quiet_NaN();
}

template <class Space> void RecursiveMotion<Space>::find_laws(const double *times, int count) {
  foreseen_times_.assign(times, times + count);
  laws_.find(times, count), laws_.accelerations(sign_.data(), targets_);
  next_foreseen_ = 0;
}

template <class Space> Forces<double> RecursiveMotion<Space>::act(double t, const double *q, const double *v) {
  Forces<double> forces;
  if (has_given_) {
    force_.setZero();
    for (const Load &load : scene_.loads) {
      const double magnitude = load.magnitude(t).value;
      for (const auto &[i, share] : load.along)
        force_[i] += magnitude * share;
    }
    for (const JointForce &joint : scene_.joint_forces)
      force_[joint.v] -= joint.stiffness * (q[joint.q] - joint.rest) + joint.friction.resistance(v[joint.v]);
    for (const auto &[a, b, ratio, stiffness, damping] : scene_.gears) {
      const double moment = stiffness * (q[a.q] - ratio * q[b.q]) + damping * (v[a.v] - ratio * v[b.v]);
      force_[a.v] -= moment, force_[b.v] += ratio * moment;
    }
    if (held_)
      held_->add(q, force_.data());
    forces.generalized = force_.data();
  }
  if (has_wrenches_) {
    wrench_.setZero();
    for (const PointLoad &load : scene_.point_loads)
      wrench_[Space::dim * load.wrench + load.component] += load.share * load.magnitude(t).value;
    if (steering_)
      steering_->add(t, q, force_.data(), wrench_.data());
    if (!scene_.point_forces.empty() || !scene_.cut_joints.empty()) {
      place_all(mechanism_, q, v, forces, workspace_), forces.is_placed = true;
      add_at_points(mechanism_, scene_.point_forces, t, norm_.sizes().length(), workspace_, wrench_.data());
      act_along_cuts(t);
    }
    forces.wrench = wrench_.data();
  }
  return forces;
}

template <class Space>
[[gnu::always_inline]] inline void RecursiveMotion<Space>::evaluate_here(double t, const double *q, const double *v,
                                                                         double *a) {
  update_targets(t);
  Forces<double> forces;
  if (has_given_ || has_wrenches_)
    forces = act(t, q, v);
  else
    forces.is_placed = is_placed_;
  is_placed_ = false;
  accelerations(mechanism_, q, v, forces, target_, workspace_, a);
}

template <class Space> void RecursiveMotion<Space>::evaluate(double t, const double *q, const double *v, double *a) {
  evaluate_here(t, q, v, a);
}

template <class Space> void RecursiveMotion<Space>::act_along_cuts(double t) {
  const std::vector<CutJoint> &cuts = scene_.cut_joints;
  cut_rates(mechanism_, cuts, workspace_, along_cuts_.data());
  for (std::size_t k = 0; k < cuts.size(); ++k) {
    double &along = along_cuts_[static_cast<Index>(k)];
    along = -cuts[k].friction.resistance(along);
  }
  for (const CutLoad &load : scene_.cut_loads)
    along_cuts_[load.joint] += load.share * load.magnitude(t).value;
  add_along_cuts(mechanism_, cuts, along_cuts_.data(), workspace_, wrench_.data());
}

template <class Space> void RecursiveMotion<Space>::slope(double t, const double *z, double *z_dot) {
  const double *q = local().state(z), *v = z + n_v();
  local().rate(z, z_dot);
  evaluate_here(t, q, v, z_dot + n_v());
  if (loops_ && !loops_->has_begun())
    loops_->begin_at(q, workspace_, newton_);
  posture_is_old_ = true;
  if (!remembers_slopes())
    return;
  std::copy_n(q, mechanism_.n_q, evaluated_.data());
  std::copy_n(v, n_v(), rates_.data());
}

template <class Space>
void RecursiveMotion<Space>::residuals(double t, const double *q, const double *v, Workspace<Space, double> &w) {
  update_targets(t);
  measure(mechanism_, q, v, w, value_.data(), rate_.data());
  is_placed_ = &w == &workspace_;
  for (Index r = 0; r < value_.size(); ++r) {
    const Jet law = laws_.jet(now_, static_cast<std::size_t>(r));
    value_[r] = mechanism_.rows[static_cast<std::size_t>(r)].apart(value_[r], sign_[r] * law.value);
    rate_[r] -= sign_[r] * law.rate;
  }
}

template <class Space> double RecursiveMotion<Space>::project(double t, double *q, double *v) {
  return project(t, q, v, measured_);
}

template <class Space>
double RecursiveMotion<Space>::project(double t, double *q, double *v, Workspace<Space, double> &w) {
  // Rounding of positions, moved into fast modes, is noise in their forces.
  constexpr double tolerance = 1e-12;
  constexpr int refresh_after = 3, most_iterations = 12;
  if (mechanism_.rows.empty())
    return 0;
  Eigen::Map<VectorXd> v_(v, n_v());
  double left = 0, previous = std::numeric_limits<double>::infinity();
  for (int i = 0; i < most_iterations; ++i) {
    residuals(t, q, v, w);
    const double position = norm_.sizes().of_values(value_, q);
    left = std::max(position, norm_.sizes().of_rates(rate_, v));
    if (!(left > tolerance) || (left < 1e-11 && left > 0.2 * previous)) // done, at the rounding floor, or NaN
      break;
    previous = left;
    is_placed_ = false;
    if (i >= refresh_after)
      evaluate(t, q, v, correction_.data());
    response(mechanism_, q, rate_.data(), workspace_, correction_.data());
    v_ += correction_;
    if (position > tolerance) {
      response(mechanism_, q, value_.data(), workspace_, correction_.data());
      local().space().integrate(q, 1, correction_.data(), q);
    }
  }
  return left;
}

template <class Space> bool RecursiveMotion<Space>::correct(double t, double *z) {
  if (local().space().is_flat())
    return project(t, z, z + n_v()) < 1e-11;
  state_ = Eigen::Map<const VectorXd>(local().state(z), local().state_size());
  const double left = project(t, state_.data(), state_.data() + mechanism_.n_q);
  local().from_state(state_.data(), z);
  return left < 1e-11;
}

// What rows leave is measured with the kinematics that the slope needs, too.
template <class Space> bool RecursiveMotion<Space>::finish(double t, double *z, double *z_dot) {
  if (has_given_ || has_wrenches_ || !local().space().is_flat())
    return ImplicitSystem::finish(t, z, z_dot);
  const bool is_on_rows = project(t, z, z + n_v(), workspace_) < 1e-11;
  if (is_on_rows)
    slope(t, z, z_dot);
  is_placed_ = false;
  return is_on_rows;
}

template <class Space> void RecursiveMotion<Space>::judge(MotorForces<Space> &motors) {
  motors_ = &motors;
  norm_.add_motors(motors.are_moments());
}

template <class Space> const VectorXd *RecursiveMotion<Space>::motors_at(const double *q) {
  return motors_ && norm_.judges_motors() ? &motors_->find(q, workspace_) : nullptr;
}

template <class Space> double RecursiveMotion<Space>::error_size(double t, const double *z, const double *e) {
  const double size = norm_.of_state(e);
  norm_.observe(workspace_, motors_at(local().state(z)));
  if (!norm_.observes())
    return size;
  if (loops_ && !(loops_->cosine(local().state(z), workspace_) > 0)) // shorter steps end before that posture
    return std::numeric_limits<double>::infinity();
  // Forces amplify errors of the state (stiffness times the error of a fast mode): measure what e does to them. Where
  // it is small, in a difference that rounding of forces does not disturb.
  const double stretch = size > 0 ? std::max(1.0, least_shift / size) : 1;
  shifted_ = Eigen::Map<const VectorXd>(z, 2 * n_v()) + stretch * Eigen::Map<const VectorXd>(e, 2 * n_v());
  const double *q = local().state(shifted_.data());
  evaluate(t, q, shifted_.data() + n_v(), unused_.data());
  const double of_forces = norm_.of_observed(workspace_, motors_at(q)) / stretch;
  return of_forces <= size || std::isnan(size) ? size : of_forces; // keeps NaN
}

template <class Space>
double RecursiveMotion<Space>::change_size(const double *, const double *change, double rate) const {
  return norm_.of_change(change, rate);
}

template <class Space> void RecursiveMotion<Space>::accepted(double t, const double *z, const double *z_dot) {
  if (accepted_ == 0)
    norm_.observe(workspace_, motors_at(local().state(z)));
  if (loops_ && loops_->is_far())
    loops_->begin_at(local().state(z), workspace_, newton_);
  norm_.take(z, z_dot, has_given_ ? force_.data() : nullptr, workspace_);
  if (accepted_ % steps_between_postures_ == 0)
    watch_posture(t, local().state(z));
  ++accepted_;
}

template <class Space> void RecursiveMotion<Space>::watch_posture(double t, const double *q) {
  if (!scene_.watch)
    return;
  update_targets(t);
  Posture posture = posture_at(mechanism_, *scene_.watch, q, measured_);
  double at = t;
  if (posture.determinant * determinant_ < 0) { // between this posture and the last
    posture.ratio = 0;
    at -= (t - watched_at_) * posture.determinant / (posture.determinant - determinant_);
  }
  determinant_ = posture.determinant, watched_at_ = t;
  if (posture.ratio < least_ratio_) {
    least_ratio_ = posture.ratio, singular_at_ = at;
    singular_posture_ = Eigen::Map<const VectorXd>(q, mechanism_.n_q);
  }
}

template <class Space> Index RecursiveMotion<Space>::prescribed() const {
  const std::size_t count =
      scene_.targets.size() + scene_.loads.size() + scene_.point_loads.size() + scene_.cut_loads.size();
  return static_cast<Index>(count);
}

template <class Space> void RecursiveMotion<Space>::prescribe(double t, double *f) {
  update_targets(t);
  f = std::copy_n(target_, scene_.targets.size(), f);
  for (const Load &load : scene_.loads)
    *f++ = load.magnitude(t).value;
  for (const PointLoad &load : scene_.point_loads)
    *f++ = load.magnitude(t).value;
  for (const CutLoad &load : scene_.cut_loads)
    *f++ = load.magnitude(t).value;
}

template <class Space> bool RecursiveMotion<Space>::is_sensible(const double *z) const {
  for (std::size_t i = 0; i < scene_.most_bent.size(); ++i) {
    const Node<Space> &node = mechanism_.nodes[i];
    if (!(Eigen::Map<const VectorXd>(z + node.p_v(), node.n()).squaredNorm() <= scene_.most_bent[i]))
      return false;
  }
  return least_ratio_ >= singular_ratio &&
         (0 * Eigen::Map<const Eigen::ArrayXd>(z, 2 * n_v())).sum() == 0; // all finite
}

template <class Space> MotionHistory RecursiveMotion<Space>::history() const {
  return {norm_.peaks(), accepted_, least_ratio_, singular_at_, singular_posture_, watched_at_, determinant_};
}

template <class Space> void RecursiveMotion<Space>::go_on(const MotionHistory &history) {
  norm_.set_peaks(history.peaks);
  accepted_ = history.accepted;
  least_ratio_ = history.least_ratio, singular_at_ = history.singular_at;
  singular_posture_ = history.singular_posture;
  watched_at_ = history.watched_at, determinant_ = history.determinant;
}

template class RecursiveMotion<Planar>;
template class RecursiveMotion<Spatial>;

} // namespace ffrobot::recursion
