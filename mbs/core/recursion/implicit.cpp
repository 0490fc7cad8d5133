// What implicit integrators ask of a motion: its matrix of Newton's method, rows and their values.
#include "core/recursion/motion.h"

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
  for (Index i = 0; i < n_stiff(); ++i)
    if (stiffness_[i] != 0 || damping_[i] != 0)
      stiff_.push_back(i);
  compliance_.resize(n_v(), static_cast<Index>(stiff_.size()));
}

template <class Space> void RecursiveMotion<Space>::find_coupling() {
  VectorXd unit = VectorXd::Zero(n_v());
  for (Index i = 0; i < n_v(); ++i) {
    unit[i] = 1;
    cut_rates(mechanism_, scene_.cut_joints, evaluated_.data(), unit.data(), measured_, along_cuts_.data());
    coupling_.row(i) = along_cuts_.transpose();
    unit[i] = 0;
  }
}

// Columns of P: what a unit of force at each stiff coordinate changes. At rest, where the least is subtracted.
template <class Space> void RecursiveMotion<Space>::find_compliance() {
  if (!compliance_is_old_)
    return;
  if (coupling_.size() > 0)
    find_coupling();
  const VectorXd rest = VectorXd::Zero(n_v()), held = VectorXd::Zero(target_.size());
  VectorXd unit = rest, base(n_v()), a(n_v());
  Forces<double> forces;
  forces.generalized = unit.data();
  const auto respond = [&](VectorXd &to) {
    accelerations(mechanism_, evaluated_.data(), rest.data(), forces, held.data(), newton_, to.data());
  };
  for (std::size_t k = 0; k < stiff_.size(); ++k) {
    if (const Index i = stiff_[k]; i < n_v())
      unit[i] = 1;
    else
      unit = coupling_.col(i - n_v());
    respond(a);
    compliance_.col(static_cast<Index>(k)) = a;
    unit.setZero();
  }
  respond(base);
  compliance_.colwise() -= base;
  base_ = evaluated_;
  compliance_is_old_ = false;
}

// B v of the last slope()
template <class Space> VectorXd RecursiveMotion<Space>::stiff_rates() const {
  VectorXd found(n_stiff());
  found << rates_, coupling_.transpose() * rates_;
  return found;
}

template <class Space> void RecursiveMotion<Space>::factorise(double damping_factor, double stiffness_factor) {
  find_compliance();
  take_friction(scene_, stiff_rates(), damping_);
  real_.factorise(compliance_, coupling_, stiff_, (damping_factor * damping_ + stiffness_factor * stiffness_)(stiff_));
}

template <class Space> void RecursiveMotion<Space>::factorise(Complex damping_factor, Complex stiffness_factor) {
  find_compliance();
  take_friction(scene_, stiff_rates(), damping_);
  complex_.factorise(compliance_, coupling_, stiff_,
                     (damping_factor * damping_ + stiffness_factor * stiffness_)(stiff_));
}

template <class Space> void RecursiveMotion<Space>::solve(const double *r, const double *c, double *x) {
  Eigen::Map<VectorXd> x_(x, n_v());
  if (c) {
    response(mechanism_, base_.data(), c, newton_, x);
    x_ = -x_;
  } else
    x_.setZero();
  real_.solve(r, x);
}

template <class Space> void RecursiveMotion<Space>::solve(const Complex *r, Complex *x) {
  Eigen::Map<Eigen::VectorXcd>(x, n_v()).setZero();
  complex_.solve(r, x);
}

// Rates of rows are linear in velocities, but for those of markers that turn.
template <class Space> void RecursiveMotion<Space>::constrain(const double *x, double *c) {
  measure(mechanism_, base_.data(), x, measured_, value_.data(), c);
  if (scene_.driven.empty())
    return;
  const VectorXd rest = VectorXd::Zero(n_v());
  measure(mechanism_, base_.data(), rest.data(), measured_, value_.data(), rate_.data());
  Eigen::Map<VectorXd>(c, rate_.size()) -= rate_;
}

template <class Space>
void RecursiveMotion<Space>::constraint_values(double t, const double *z, double *value, double *rate) {
  residuals(t, local().state(z), z + n_v());
  Eigen::Map<VectorXd>(value, value_.size()) = value_;
  Eigen::Map<VectorXd>(rate, rate_.size()) = rate_;
}

#define FFROBOT_IMPLICIT(Space)                                                                                        \
  template void RecursiveMotion<Space>::find_stiff_terms();                                                            \
  template void RecursiveMotion<Space>::find_coupling();                                                               \
  template VectorXd RecursiveMotion<Space>::stiff_rates() const;                                                       \
  template void RecursiveMotion<Space>::find_compliance();                                                             \
  template void RecursiveMotion<Space>::factorise(double, double);                                                     \
  template void RecursiveMotion<Space>::factorise(Complex, Complex);                                                   \
  template void RecursiveMotion<Space>::solve(const double *, const double *, double *);                               \
  template void RecursiveMotion<Space>::solve(const Complex *, Complex *);                                             \
  template void RecursiveMotion<Space>::constrain(const double *, double *);                                           \
  template void RecursiveMotion<Space>::constraint_values(double, const double *, double *, double *)

FFROBOT_IMPLICIT(Planar);
FFROBOT_IMPLICIT(Spatial);

} // namespace ffrobot::recursion
