// What implicit integrators ask of a motion: its matrix of Newton's method, rows and their values.
#include "core/recursion/motion.h"

#include <stdexcept>

namespace ffrobot::recursion {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

// Diagonals (n_v, then cut joints): of elastic and damping forces of modes, of springs in joints.
template <class Space>
void stiff_terms(const Mechanism<Space> &m, const Scene &scene, VectorXd &stiffness, VectorXd &damping) {
  stiffness = damping = VectorXd::Zero(m.n_v + static_cast<Index>(scene.cut_joints.size()));
  for (const Node<Space> &node : m.nodes)
    for (int i = 0; i < node.n(); ++i) {
      stiffness[node.p_v() + i] = node.body.K[i];
      damping[node.p_v() + i] = node.body.D_full.size() ? node.body.D_full(i, i) : node.body.D[i];
    }
  for (const JointForce &joint : scene.joint_forces)
    stiffness[joint.v] += joint.stiffness;
}

// Of friction in joints, at the rates v (n_v, then cut joints). Near rest dry friction is a stiff damper: a light
// link's end that sticks to what it carries comes to rest within nanoseconds.
void take_friction(const Scene &scene, const VectorXd &v, VectorXd &damping) {
  for (const JointForce &joint : scene.joint_forces)
    damping[joint.v] = 0;
  for (const JointForce &joint : scene.joint_forces)
    damping[joint.v] += joint.friction.slope(v[joint.v]);
  const Index n_v = v.size() - static_cast<Index>(scene.cut_joints.size());
  for (std::size_t k = 0; k < scene.cut_joints.size(); ++k) {
    const Index i = n_v + static_cast<Index>(k);
    damping[i] = scene.cut_joints[k].friction.slope(v[i]);
  }
}

} // namespace

template <class Space> void RecursiveMotion<Space>::find_stiff_terms() {
  stiff_terms(mechanism_, scene_, stiffness_, damping_);
  coupling_.setZero(n_v(), stiffness_.size() - n_v());
  take_friction(scene_, VectorXd::Zero(n_stiff()), damping_); // at rest, where none that acts has a slope of zero
  std::size_t node = 0;
  for (const Node<Space> &joint : mechanism_.nodes)
    if (posture_.body(node++).turn.size() > 0 && (stiffness_[joint.v] != 0 || damping_[joint.v] != 0))
      turned_.push_back(joint.v);
}

template <class Space> void RecursiveMotion<Space>::find_coupling() {
  VectorXd unit = VectorXd::Zero(n_v());
  for (Index i = 0; i < n_v(); ++i) {
    unit[i] = 1;
    place_all(mechanism_, evaluated_.data(), unit.data(), Forces<double>(), measured_);
    cut_rates(mechanism_, scene_.cut_joints, measured_, along_cuts_.data());
    coupling_.row(i) = along_cuts_.transpose();
    unit[i] = 0;
  }
}

template <class Space> void RecursiveMotion<Space>::take_posture() {
  if (!posture_is_old_)
    return;
  if (!remembers_slopes())
    throw std::logic_error("factorise: expected remember_slopes() before the slope");
  posture_.take(evaluated_.data(), newton_);
  if (coupling_.size() > 0)
    find_coupling();
  const auto kept = static_cast<Index>(newton_.active.size()), turned = static_cast<Index>(turned_.size());
  newton_rows_.setZero(kept + coupling_.cols() + turned, n_v());
  newton_rows_.topRows(kept) = posture_.gradients()(newton_.active, Eigen::all);
  newton_rows_.middleRows(kept, coupling_.cols()) = coupling_.transpose();
  for (Index k = 0; k < turned; ++k)
    newton_rows_(kept + coupling_.cols() + k, turned_[static_cast<std::size_t>(k)]) = 1;
  posture_is_old_ = false;
}

// B v of the last slope()
template <class Space> VectorXd RecursiveMotion<Space>::stiff_rates() const {
  VectorXd found(n_stiff());
  found << rates_, coupling_.transpose() * rates_;
  return found;
}

template <class Space>
template <class Scalar>
void RecursiveMotion<Space>::factorise(NewtonMatrix<Space, Scalar> &matrix, Scalar damping_factor,
                                       Scalar stiffness_factor) {
  using Vector = Eigen::Matrix<Scalar, Eigen::Dynamic, 1>;
  take_posture();
  take_friction(scene_, stiff_rates(), damping_);
  const Vector E = damping_factor * damping_ + stiffness_factor * stiffness_;
  Vector of_tree = E.head(n_v()), extra(coupling_.cols() + static_cast<Index>(turned_.size()));
  extra << E.tail(coupling_.cols()), of_tree(turned_);
  of_tree(turned_).setZero();
  matrix.factorise(posture_, newton_rows_, of_tree, extra);
}

template <class Space> void RecursiveMotion<Space>::factorise(double damping_factor, double stiffness_factor) {
  factorise(real_, damping_factor, stiffness_factor);
}

template <class Space> void RecursiveMotion<Space>::factorise(Complex damping_factor, Complex stiffness_factor) {
  factorise(complex_, damping_factor, stiffness_factor);
}

// x = B^T r
template <class Space> template <class Scalar> void RecursiveMotion<Space>::spread(const Scalar *r, Scalar *x) const {
  using Vector = Eigen::Matrix<Scalar, Eigen::Dynamic, 1>;
  Eigen::Map<Vector> x_(x, n_v());
  x_ = Eigen::Map<const Vector>(r, n_v());
  if (coupling_.cols() > 0)
    x_ += coupling_ * Eigen::Map<const Vector>(r + n_v(), coupling_.cols());
}

template <class Space> void RecursiveMotion<Space>::solve(const double *r, const double *c, double *x) {
  spread(r, x);
  if (!c) {
    real_.solve(nullptr, x);
    return;
  }
  const VectorXd kept = Eigen::Map<const VectorXd>(c, constraints())(newton_.active);
  real_.solve(kept.data(), x);
}

template <class Space> void RecursiveMotion<Space>::solve(const Complex *r, Complex *x) {
  spread(r, x);
  complex_.solve(nullptr, x);
}

template <class Space> void RecursiveMotion<Space>::constrain(const double *x, double *c) {
  Eigen::Map<VectorXd>(c, constraints()) = posture_.gradients() * Eigen::Map<const VectorXd>(x, n_v());
}

template <class Space>
void RecursiveMotion<Space>::constraint_values(double t, const double *z, double *value, double *rate) {
  residuals(t, local().state(z), z + n_v(), measured_);
  Eigen::Map<VectorXd>(value, value_.size()) = value_;
  Eigen::Map<VectorXd>(rate, rate_.size()) = rate_;
}

template <class Space> double RecursiveMotion<Space>::value_size(const double *z, const VectorXd &value) const {
  return norm_.sizes().of_values(value, local().state(z));
}

template <class Space> double RecursiveMotion<Space>::rate_size(const double *z, const VectorXd &rate) const {
  return norm_.sizes().of_rates(rate, z + n_v());
}

#define FFROBOT_IMPLICIT(Space)                                                                                        \
  template void RecursiveMotion<Space>::find_stiff_terms();                                                            \
  template void RecursiveMotion<Space>::find_coupling();                                                               \
  template VectorXd RecursiveMotion<Space>::stiff_rates() const;                                                       \
  template void RecursiveMotion<Space>::take_posture();                                                                \
  template void RecursiveMotion<Space>::factorise(double, double);                                                     \
  template void RecursiveMotion<Space>::factorise(Complex, Complex);                                                   \
  template void RecursiveMotion<Space>::solve(const double *, const double *, double *);                               \
  template void RecursiveMotion<Space>::solve(const Complex *, Complex *);                                             \
  template void RecursiveMotion<Space>::constrain(const double *, double *);                                           \
  template double RecursiveMotion<Space>::value_size(const double *, const VectorXd &) const;                          \
  template double RecursiveMotion<Space>::rate_size(const double *, const VectorXd &) const;                           \
  template void RecursiveMotion<Space>::constraint_values(double, const double *, double *, double *)

FFROBOT_IMPLICIT(Planar);
FFROBOT_IMPLICIT(Spatial);

} // namespace ffrobot::recursion
