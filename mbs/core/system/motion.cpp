#include "core/system/motion.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace ffrobot {

using Eigen::Index;
using VectorMap = Eigen::Map<const Eigen::VectorXd>;

ConstrainedMotion::ConstrainedMotion(const System &system, ErrorNorm norm, ExternalLoads *external_loads)
    : ImplicitSystem(system.space), system_(system), workspace_(system), norm_(std::move(norm)),
      external_loads_(external_loads), evaluated_at_(std::numeric_limits<double>::quiet_NaN()), shifted_(size()),
      shifted_slope_(size()) {
  stiffness_ = damping_ = Eigen::VectorXd::Zero(n_v());
  for (std::size_t b = 0; b < system.bodies.size(); ++b) {
    const PlanarBody &body = system.bodies[b];
    const Index first = system.first_coordinate[b] + 3;
    stiffness_.segment(first, body.modes()) = body.stiffness;
    if (body.damping.cols() == 1)
      damping_.segment(first, body.modes()) = body.damping;
    else if (body.damping.cols() > 1)
      damping_.segment(first, body.modes()) = body.damping.diagonal();
  }
}

void ConstrainedMotion::slope(double t, const double *z, double *z_dot) {
  const Index n = n_v();
  if (external_loads_)
    external_loads_->apply(t, workspace_);
  local().rate(z, z_dot);
  accelerations(system_, t, local().state(z), z + n, workspace_, z_dot + n);
  evaluated_at_ = t;
}

Index ConstrainedMotion::prescribed() const {
  return static_cast<Index>(system_.drives.size() + system_.modal_drives.size() + system_.constraints.size());
}

void ConstrainedMotion::prescribe(double t, double *f) {
  for (const Drive &drive : system_.drives)
    *f++ = drive.magnitude(t).value;
  for (const ModalDrive &drive : system_.modal_drives)
    *f++ = drive.magnitude(t).value;
  for (const Constraint &constraint : system_.constraints)
    *f++ = constraint.target(t).acceleration;
}

bool ConstrainedMotion::correct(double t, double *z) {
  if (system_.space.is_flat())
    return project(system_, t, z, z + n_v(), workspace_) < 1e-11;
  Eigen::VectorXd y = VectorMap(local().state(z), local().state_size());
  const double left = project(system_, t, y.data(), y.data() + system_.n_q(), workspace_);
  local().from_state(y.data(), z);
  return left < 1e-11;
}

double ConstrainedMotion::error_size(double t, const double *z, const double *e) {
  assert(evaluated_at_ == t);
  const double size = norm_.of_state(z, e);
  norm_.observe(workspace_, observed_);
  if (!norm_.observes())
    return size;
  // Forces amplify errors of the state (stiffness times the error of a fast mode): measure what e does to them.
  shifted_ = VectorMap(z, this->size()) + VectorMap(e, this->size());
  slope(t, shifted_.data(), shifted_slope_.data());
  return std::isnan(size) ? size : std::max(norm_.of_observed(observed_, workspace_), size); // keeps NaN
}

// Stages of dense output may have been evaluated since the step was judged.
void ConstrainedMotion::accepted(double, const double *z, const double *z_dot) {
  if (observed_.size() == 0)
    norm_.observe(workspace_, observed_);
  norm_.take(z, z_dot, observed_, workspace_);
}

void ConstrainedMotion::factorise(double damping_factor, double stiffness_factor) {
  assert(!std::isnan(evaluated_at_));
  if (!real_)
    real_ = std::make_unique<IterationMatrix<double>>(system_);
  real_->factorise(workspace_, damping_, damping_factor, stiffness_, stiffness_factor);
}

void ConstrainedMotion::factorise(Complex damping_factor, Complex stiffness_factor) {
  assert(!std::isnan(evaluated_at_));
  if (!complex_)
    complex_ = std::make_unique<IterationMatrix<Complex>>(system_);
  complex_->factorise(workspace_, damping_, damping_factor, stiffness_, stiffness_factor);
}

void ConstrainedMotion::constraint_values(double t, const double *z, double *value, double *rate) {
  constraint_residuals(system_, t, local().state(z), z + n_v(), workspace_, value, rate);
}

// Small deformations end long before the mean square of a body's deflection, p^T p / m, is that of its radius.
bool ConstrainedMotion::is_sensible(const double *z) const {
  for (std::size_t b = 0; b < system_.bodies.size(); ++b) {
    const PlanarBody &body = system_.bodies[b];
    if (!(VectorMap(z + system_.first_coordinate[b] + 3, body.modes()).squaredNorm() <= body.inertia))
      return false;
  }
  return true;
}

} // namespace ffrobot
