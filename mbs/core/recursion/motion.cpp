#include "core/recursion/motion.h"

#include "core/recursion/independent_rows.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace ffrobot::recursion {

using Eigen::Index;
using Eigen::VectorXd;

template <class Space>
RecursiveMotion<Space>::RecursiveMotion(const Mechanism<Space> &mechanism, const Scene &scene, const double *q,
                                        const double *v)
    : ImplicitSystem(ConfigurationSpace(mechanism.n_v, mechanism.rotations)), mechanism_(mechanism), scene_(scene),
      workspace_(mechanism), measured_(mechanism), newton_(mechanism), force_(VectorXd::Zero(mechanism.n_v)),
      target_(VectorXd::Zero(static_cast<Index>(mechanism.rows.size()))), value_(target_), rate_(target_),
      correction_(force_), state_(VectorXd::Zero(mechanism.n_q + mechanism.n_v)), jets_(mechanism.rows.size()),
      target_time_(std::numeric_limits<double>::quiet_NaN()) {
  keep_independent_rows(mechanism, q, v, workspace_);
  newton_.keep(workspace_.active);
  find_stiff_terms();
  int groups = 2; // ways of joints, angles of joints
  pace_ = {1e-3, 1e-3};
  const Index n = mechanism.n_v;
  group_.assign(static_cast<std::size_t>(2 * n), 0);
  for (const Node<Space> &node : mechanism.nodes) {
    for (int k = 0; k < node.shape.freedoms.count; ++k)
      group_[static_cast<std::size_t>(node.v + k)] = node.shape.freedoms.component[k] < Space::linear ? 0 : 1;
    double lowest = std::numeric_limits<double>::infinity();
    for (int k = 0; k < node.n(); ++k) {
      group_[static_cast<std::size_t>(node.p_v() + k)] = groups;
      lowest = std::min(lowest, std::sqrt(node.body.K[static_cast<std::size_t>(k)]));
    }
    groups += node.n() > 0 ? 1 : 0;
    if (node.n() > 0)
      pace_.push_back(lowest);
    for (int k = 0; k < node.n(); ++k)
      fastest_ = std::max(fastest_, std::sqrt(node.body.K[static_cast<std::size_t>(k)]));
  }
  for (Index i = 0; i < n; ++i)
    group_[static_cast<std::size_t>(n + i)] = group_[static_cast<std::size_t>(i)] + groups;
  peak_.assign(static_cast<std::size_t>(2 * groups), 0.0);
  size_ = peak_;
}

template <class Space> void RecursiveMotion<Space>::update_targets(double t) {
  if (t == target_time_)
    return;
  for (std::size_t r = 0; r < scene_.targets.size(); ++r)
    jets_[r] = scene_.targets[r](t), target_[static_cast<Index>(r)] = jets_[r].acceleration;
  target_time_ = t;
}

template <class Space> void RecursiveMotion<Space>::evaluate(double t, const double *q, const double *v, double *a) {
  update_targets(t);
  Forces<double> forces;
  if (!scene_.loads.empty() || !scene_.joint_forces.empty()) {
    force_.setZero();
    for (const Load &load : scene_.loads)
      force_ += load.magnitude(t).value * load.direction;
    for (const JointForce &joint : scene_.joint_forces)
      force_[joint.v] -= joint.stiffness * (q[joint.q] - joint.rest) + joint.friction.resistance(v[joint.v]);
    forces.generalized = force_.data();
  }
  accelerations(mechanism_, q, v, forces, target_.data(), workspace_, a);
}

template <class Space> void RecursiveMotion<Space>::slope(double t, const double *z, double *z_dot) {
  local().rate(z, z_dot);
  const double *q = local().state(z);
  evaluate(t, q, z + n_v(), z_dot + n_v());
  evaluated_ = Eigen::Map<const VectorXd>(q, mechanism_.n_q);
  compliance_is_old_ = true;
}

template <class Space> void RecursiveMotion<Space>::residuals(double t, const double *q, const double *v) {
  update_targets(t);
  measure(mechanism_, q, v, measured_, value_.data(), rate_.data());
  for (std::size_t r = 0; r < jets_.size(); ++r) {
    value_[static_cast<Index>(r)] -= jets_[r].value;
    rate_[static_cast<Index>(r)] -= jets_[r].rate;
  }
}

template <class Space> double RecursiveMotion<Space>::project(double t, double *q, double *v) {
  // As in core/system/system.cpp: rounding of positions, moved into fast modes, is noise in their forces.
  constexpr double tolerance = 1e-12;
  constexpr int refresh_after = 3, most_iterations = 12;
  if (mechanism_.rows.empty())
    return 0;
  Eigen::Map<VectorXd> v_(v, n_v());
  double left = 0, previous = std::numeric_limits<double>::infinity();
  for (int i = 0; i < most_iterations; ++i) {
    residuals(t, q, v);
    const double scale_q = 1 + Eigen::Map<VectorXd>(q, mechanism_.n_q).template lpNorm<Eigen::Infinity>();
    const double scale_v = 1 + v_.template lpNorm<Eigen::Infinity>();
    const double position = value_.template lpNorm<Eigen::Infinity>() / scale_q;
    left = std::max(position, rate_.template lpNorm<Eigen::Infinity>() / scale_v);
    if (!(left > tolerance) || (left < 1e-11 && left > 0.2 * previous)) // done, at the rounding floor, or NaN
      break;
    previous = left;
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

template <class Space> double RecursiveMotion<Space>::error_size(double, const double *z, const double *e) {
  return change_size(z, e, 0);
}

template <class Space> double RecursiveMotion<Space>::change_size(const double *, const double *e, double) const {
  std::fill(size_.begin(), size_.end(), 0.0);
  for (std::size_t i = 0; i < group_.size(); ++i)
    size_[static_cast<std::size_t>(group_[i])] += e[i] * e[i];
  double worst = 0;
  for (std::size_t g = 0; g < size_.size(); ++g)
    if (const double size = std::sqrt(size_[g]) / std::max(peak_[g], 1e-12); !(size <= worst))
      worst = size; // keeps NaN
  return worst;
}

template <class Space> void RecursiveMotion<Space>::accepted(double, const double *z, const double *) {
  std::fill(size_.begin(), size_.end(), 0.0);
  for (std::size_t i = 0; i < group_.size(); ++i)
    size_[static_cast<std::size_t>(group_[i])] += z[i] * z[i];
  for (std::size_t g = 0; g < size_.size(); ++g)
    peak_[g] = std::max(peak_[g], std::sqrt(size_[g]));
  // Rotation vectors start at zero in every step: an angle is compared with one radian at least.
  peak_[1] = std::max(peak_[1], 1.0);
  // At rest, as in equilibrium, all rates are zero: their errors are then compared with rates that would be slow.
  for (std::size_t g = 0; g < pace_.size(); ++g)
    peak_[pace_.size() + g] = std::max(peak_[pace_.size() + g], pace_[g] * peak_[g]);
}

template <class Space> bool RecursiveMotion<Space>::is_sensible(const double *z) const {
  return Eigen::Map<const VectorXd>(z, 2 * n_v()).allFinite();
}

template class RecursiveMotion<Planar>;
template class RecursiveMotion<Spatial>;

} // namespace ffrobot::recursion
