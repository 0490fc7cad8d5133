#include "core/recursion/motion/newton_system.h"

#include "core/linear/symmetric_factors.h"

namespace ffrobot::recursion {

namespace {

// N, N m: a force beside which what acts at rest is small, so that differences of accelerations keep their digits
constexpr double large_force = 1e4;

constexpr double least_root = 1e-100; // of E: B x is found as y / S

// A x, A real
VectorXd product(const MatrixXd &A, const VectorXd &x) { return A * x; }
VectorXcd product(const MatrixXd &A, const VectorXcd &x) {
  VectorXcd y(A.rows());
  y.real() = A * x.real(), y.imag() = A * x.imag();
  return y;
}

} // namespace

template <class Space>
NewtonSystem<Space>::NewtonSystem(const Mechanism<Space> &mechanism, const Scene &scene)
    : OdeSystem(ConfigurationSpace(mechanism.n_v, mechanism.rotations)), mechanism_(mechanism), scene_(scene),
      at_rest_(mechanism), q_(VectorXd::Zero(mechanism.n_q)), rest_(VectorXd::Zero(mechanism.n_v)) {
  // Elastic and damping forces of modes, springs in joints and gears
  auto coupled = scene_.cut_joints.size();
  const Index all = coupled + scene_.gears.size();
  stiffness_ = damping_ = VectorXd::Zero(rest_.size() + all);
  coupling_.setZero(rest_.size(), all);
  std::vector<char> is_stiff(rest_.size() + all);
  std::fill(is_stiff.end() - all, is_stiff.end(), 1);
  for (const GearSpring &gear : scene_.gears) {
    damping_[rest_.size() + coupled] = gear.damping;
    coupling_(gear.a.v, coupled) = 1, coupling_(gear.b.v, coupled++) = -gear.ratio;
  }
  for (const Node<Space> &node : mechanism_.nodes)
    for (int i = 0; i < node.n(); ++i) {
      stiffness_[node.p_v() + i] = node.body.K[i];
      damping_[node.p_v() + i] = node.body.D_full.size() ? node.body.D_full(i, i) : node.body.D[i];
      is_stiff[node.p_v() + i] = 1;
    }
  for (const JointForce &joint : scene_.joint_forces)
    stiffness_[joint.v] += joint.stiffness, is_stiff[joint.v] = 1;
  for (std::size_t i = 0; i < is_stiff.size(); ++i)
    (is_stiff[i] ? stiff_ : free_).push_back(i);
}

// Of gears, and of friction in joints, at rates as the diagonals. Near rest dry friction is a stiff damper: a light
// link's end that sticks to what it carries comes to rest within nanoseconds.
template <class Space> void NewtonSystem<Space>::take_slopes(const VectorXd &rates) {
  for (const JointForce &joint : scene_.joint_forces)
    damping_[joint.v] = 0;
  for (const JointForce &joint : scene_.joint_forces)
    damping_[joint.v] += joint.friction.slope(rates[joint.v]);
  Index i = rest_.size();
  for (const CutJoint &joint : scene_.cut_joints)
    damping_[i] = joint.friction.slope(rates[i]), ++i;
  for (const GearSpring &gear : scene_.gears)
    stiffness_[i++] = gear.spring.slope(q_[gear.a.q] - gear.ratio * q_[gear.b.q]);
}

template <class Space> void NewtonSystem<Space>::find_coupling() {
  VectorXd unit = rest_, rates(scene_.cut_joints.size());
  for (Index i = 0; i < unit.size(); ++i) {
    unit[i] = 1;
    cut_rates(place_all(q_.data(), unit.data(), nullptr, at_rest_), scene_.cut_joints, rates.data());
    coupling_.row(i).head(rates.size()) = rates.transpose();
    unit[i] = 0;
  }
}

template <class Space> template <class Matrix> Matrix NewtonSystem<Space>::along_stiff(const Matrix &x) const {
  Matrix found(stiff_.size(), x.cols());
  for (Index s = 0; s < found.rows(); ++s)
    if (const Index i = stiff_[s]; i < rest_.size())
      found.row(s) = x.row(i);
    else
      found.row(s) = coupling_.col(i - rest_.size()).transpose() * x;
  return found;
}

template <class Space> void NewtonSystem<Space>::find_responses() {
  const Index equations = mechanism_.constraints.size();
  const VectorXd none = VectorXd::Zero(equations);
  const auto evaluate = [&](const VectorXd &force) {
    VectorXd a(rest_.size());
    accelerations(q_.data(), rest_.data(), Forces<double>{force.data(), nullptr}, none.data(), at_rest_, a.data());
    return a;
  };
  const VectorXd start = evaluate(rest_);
  MatrixXd P(rest_.size(), stiff_.size());
  for (Index s = 0; s < P.cols(); ++s) {
    VectorXd force = rest_;
    if (const Index i = stiff_[s]; i < rest_.size())
      force[i] = large_force;
    else
      force = large_force * coupling_.col(i - rest_.size());
    P.col(s) = (evaluate(force) - start) / large_force;
  }
  G_ = along_stiff(P);
  P_ = P(free_, Eigen::all);
  R_.setZero(rest_.size(), equations);
  VectorXd unit = none;
  for (const int r : at_rest_.active) {
    unit[r] = -1;
    response(q_.data(), unit.data(), at_rest_, R_.col(r).data());
    unit[r] = 0;
  }
}

template <class Space> void NewtonSystem<Space>::linearise_at(const double *q, const double *v) {
  q_ = Map<const VectorXd>(q, q_.size());
  const Map<const VectorXd> v_(v, rest_.size());
  if (!scene_.cut_joints.empty())
    find_coupling();
  VectorXd rates(stiffness_.size());
  rates << v_, coupling_.transpose() * v_;
  take_slopes(rates);
  find_responses();
}

template <class Space>
template <class Scalar>
void NewtonSystem<Space>::factorise(Scalar damping_factor, Scalar stiffness_factor, Factors<Scalar> &to) const {
  const Vector<Scalar> E = damping_factor * damping_(stiff_) + stiffness_factor * stiffness_(stiff_);
  to.S = E.cwiseSqrt().array() + least_root;
  to.symmetric = to.S.asDiagonal() * G_ * to.S.asDiagonal();
  to.symmetric.diagonal().array() += Scalar(1);
  factorise_symmetric(to.symmetric);
}

// x: R c in, zero where it is complex
template <class Space>
template <class Scalar>
void NewtonSystem<Space>::solve(const Factors<Scalar> &factors, const Scalar *r, Map<Vector<Scalar>> x) const {
  Vector<Scalar> f = Map<const Vector<Scalar>>(r, stiffness_.size())(stiff_), stiff = along_stiff<Vector<Scalar>>(x);
  f.array() /= factors.S.array();
  f -= factors.S.cwiseProduct(stiff);
  solve_symmetric(factors.symmetric, f);
  f.array() *= factors.S.array();
  x(free_) += product(P_, f);
  stiff += product(G_, f);
  for (std::size_t s = 0; s < stiff_.size() && stiff_[s] < x.size(); ++s)
    x[stiff_[s]] = stiff[s];
}

template <class Space> void NewtonSystem<Space>::solve(const double *r, const double *c, double *x) {
  Map<VectorXd> x_(x, rest_.size());
  x_.setZero();
  if (c)
    x_ = R_ * Map<const VectorXd>(c, R_.cols());
  solve(real_, r, x_);
}

template <class Space> void NewtonSystem<Space>::solve(const Complex *r, Complex *x) {
  Map<Vector<Complex>> x_(x, rest_.size());
  x_.setZero();
  solve(complex_, r, x_);
}

template <class Space> void NewtonSystem<Space>::constrain(const double *x, double *c) {
  VectorXd value(R_.cols()), of_markers(R_.cols());
  measure(q_.data(), rest_.data(), at_rest_, value.data(), of_markers.data());
  measure(q_.data(), x, at_rest_, value.data(), c);
  Map<VectorXd>(c, R_.cols()) -= of_markers; // that turn
}

template class NewtonSystem<Planar>;
template class NewtonSystem<Spatial>;

} // namespace ffrobot::recursion
