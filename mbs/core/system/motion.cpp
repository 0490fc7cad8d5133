#include "core/system/motion.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace ffrobot {

using Eigen::Index;
using VectorMap = Eigen::Map<const Eigen::VectorXd>;

ConstrainedMotion::ConstrainedMotion(const System &system, std::vector<int> group, std::vector<bool> moment,
                                     ExternalLoads *steering)
    : system_(system), workspace_(system), group_(std::move(group)), steering_(steering),
      body_peaks_(system.bodies.size()), lambda_(workspace_.lambda), shifted_(2 * system.coordinates),
      shifted_slope_(2 * system.coordinates) {
  const int groups = group_.empty() ? 0 : *std::max_element(group_.begin(), group_.end()) + 1;
  multiplier_peaks_ = group_now_ = group_error_ = Eigen::VectorXd::Zero(groups);
  group_is_moment_.assign(static_cast<std::size_t>(groups), false);
  for (std::size_t r = 0; r < group_.size(); ++r)
    group_is_moment_[static_cast<std::size_t>(group_[r])] = moment[r];
  stiffness_ = damping_ = Eigen::VectorXd::Zero(system.coordinates);
  for (std::size_t b = 0; b < system.bodies.size(); ++b) {
    const PlanarBody &body = system.bodies[b];
    const Index first = system.first_coordinate[b] + 3;
    stiffness_.segment(first, body.modes()) = body.stiffness;
    if (body.damping.cols() == 1)
      damping_.segment(first, body.modes()) = body.damping;
    else if (body.damping.cols() > 1)
      damping_.segment(first, body.modes()) = body.damping.diagonal();
    frequency_.push_back(body.stiffness.cwiseSqrt());
  }
}

// Floors of what errors are compared with follow from the motion itself, not from a second and a meter: a robot that
// takes an hour for its path gets it as precise as one that takes a second.
void ConstrainedMotion::plan(double duration) {
  rate_ = std::max(1 / duration, std::sqrt(system_.gravity.norm() / system_.length));
}

void ConstrainedMotion::slope(double t, const double *y, double *dy) {
  const Index n = system_.coordinates;
  if (steering_)
    steering_->steer(t, workspace_);
  std::copy_n(y + n, n, dy);
  accelerations(system_, t, y, y + n, workspace_, dy + n);
}

bool ConstrainedMotion::correct(double t, double *y) {
  return project(system_, t, y, y + system_.coordinates, workspace_) < 1e-11;
}

double ConstrainedMotion::state_size(const double *y, const double *e) const {
  const Index n = system_.coordinates;
  double size = 0;
  for (std::size_t b = 0; b < system_.bodies.size(); ++b) {
    const Index i = system_.first_coordinate[b], modes = system_.bodies[b].modes();
    const double *d = e + i, *d_dot = e + n + i;
    const BodyPeaks &peak = body_peaks_[b];
    size = std::max({size, std::hypot(d[0], d[1]) / system_.length, std::abs(d[2]),
                     std::hypot(d_dot[0], d_dot[1]) / peak.velocity, std::abs(d_dot[2]) / peak.angular_velocity});
    if (modes > 0) {
      // Velocities of the modes as what they are of the body's, and as the deflections that they turn into. A robot at
      // rest under gravity: p_dot starts from nothing, with the rounding of K p integrated over a period.
      const VectorMap p(y + i + 3, modes), e_p(d + 3, modes), e_p_dot(d_dot + 3, modes);
      const double rounding = 32 * std::numeric_limits<double>::epsilon() * frequency_[b].cwiseProduct(p).norm();
      size = std::max({size, e_p.norm() / peak.modal, e_p_dot.cwiseQuotient(frequency_[b]).norm() / peak.modal,
                       (e_p_dot.norm() - rounding) / peak.modal_velocity});
    }
    if (!(size < std::numeric_limits<double>::infinity()))
      return NAN;
  }
  return size;
}

double ConstrainedMotion::change_size(const double *y, const double *change, double rate) const {
  const Index n = system_.coordinates;
  double size = state_size(y, change);
  for (std::size_t b = 0; b < system_.bodies.size(); ++b) {
    const double *d = change + n + system_.first_coordinate[b];
    const BodyPeaks &peak = body_peaks_[b];
    const double accelerations =
        std::max({std::hypot(d[0], d[1]) / peak.acceleration, std::abs(d[2]) / peak.angular_acceleration,
                  VectorMap(d + 3, system_.bodies[b].modes()).norm() / peak.modal_acceleration});
    size = rate * accelerations <= size ? size : rate * accelerations; // keeps NaN
  }
  return size;
}

// The size of each force or moment that the multipliers are components of.
void ConstrainedMotion::measure_groups(const Eigen::VectorXd &lambda, Eigen::VectorXd &size) const {
  size.setZero();
  for (std::size_t r = 0; r < group_.size(); ++r)
    size[group_[r]] += std::pow(lambda[static_cast<Index>(r)], 2);
  size = size.cwiseSqrt();
}

double ConstrainedMotion::error_size(double t, const double *y, const double *e) {
  const Index n = system_.coordinates;
  double size = state_size(y, e);
  // Forces amplify errors of the state (stiffness times the error of a fast mode): measure what e does to them.
  lambda_ = workspace_.lambda;
  has_lambda_ = true;
  if (group_.empty())
    return size;
  shifted_ = VectorMap(y, 2 * n) + VectorMap(e, 2 * n);
  slope(t, shifted_.data(), shifted_slope_.data());
  const auto length_of = [&](std::size_t g) { return group_is_moment_[g] ? system_.length : 1.0; };
  double largest = 0; // or what little would move the bodies, where nothing has happened yet
  for (std::size_t b = 0; b < system_.bodies.size(); ++b)
    largest += system_.bodies[b].mass * body_peaks_[b].acceleration;
  for (std::size_t g = 0; g < group_is_moment_.size(); ++g)
    largest = std::max(largest, multiplier_peaks_[static_cast<Index>(g)] / length_of(g));
  measure_groups(lambda_, group_now_);
  measure_groups(workspace_.lambda - lambda_, group_error_);
  for (std::size_t g = 0; g < group_is_moment_.size(); ++g) {
    const auto i = static_cast<Index>(g);
    const double scale = std::max({multiplier_peaks_[i], group_now_[i], 1e-3 * largest * length_of(g)});
    if (group_error_[i] > 0)
      size = std::max(size, group_error_[i] / scale);
    else if (!(group_error_[i] == 0))
      return NAN;
  }
  return size;
}

// Of applied loads on the modes of body b, at the last evaluation.
Eigen::VectorXd ConstrainedMotion::applied_modal_force(std::size_t b) const {
  const PlanarBodyState &state = workspace_.bodies[b];
  Eigen::VectorXd F_p = state.modal_load;
  if (state.has_wrench)
    add_modal_force(system_.bodies[b], state, state.wrench, F_p);
  return F_p;
}

void ConstrainedMotion::accepted(double, const double *y, const double *dy) {
  const Index n = system_.coordinates;
  const double length = system_.length;
  const auto raise = [](double &peak, double value) { peak = std::max(peak, value); };
  for (std::size_t b = 0; b < system_.bodies.size(); ++b) {
    const Index i = system_.first_coordinate[b], modes = system_.bodies[b].modes();
    const double *v = y + n + i, *a = dy + n + i;
    BodyPeaks &peak = body_peaks_[b];
    // floors: a hundredth of a length (a radian) in the time that counts; the vibration that accelerations would start
    const double slow = 0.01 * rate_;
    raise(peak.velocity, std::max(std::hypot(v[0], v[1]), slow * length));
    raise(peak.angular_velocity, std::max(std::abs(v[2]), slow));
    raise(peak.acceleration, std::max({std::hypot(a[0], a[1]), system_.gravity.norm(), slow * rate_ * length}));
    raise(peak.angular_acceleration, std::max(std::abs(a[2]), peak.acceleration / length));
    peak.modal_acceleration = std::max(peak.modal_acceleration, std::sqrt(system_.bodies[b].mass) * peak.acceleration);
    if (modes > 0) {
      const auto &omega = frequency_[b];
      const VectorMap p(y + i + 3, modes), p_dot(v + 3, modes), p_ddot(a + 3, modes);
      // where nothing has happened yet: a thousandth of what the acceleration would do to the softest mode
      const double force = std::sqrt(system_.bodies[b].mass) * peak.acceleration;
      applied_ = applied_modal_force(b).cwiseQuotient(omega); // may hold the links straight: p stays zero then
      raise(peak.modal, std::max({p.norm(), p_ddot.cwiseQuotient(omega).cwiseQuotient(omega).norm(),
                                  applied_.cwiseQuotient(omega).norm(), 1e-3 * force / std::pow(omega.minCoeff(), 2)}));
      raise(peak.modal_velocity, std::max({p_dot.norm(), p_ddot.cwiseQuotient(omega).norm(), applied_.norm(),
                                           std::sqrt(system_.bodies[b].mass) * peak.velocity}));
    }
  }
  measure_groups(has_lambda_ ? lambda_ : workspace_.lambda, group_now_);
  multiplier_peaks_ = multiplier_peaks_.cwiseMax(group_now_);
}

Eigen::VectorXd ConstrainedMotion::save() const {
  Eigen::VectorXd peaks(7 * static_cast<Index>(body_peaks_.size()) + multiplier_peaks_.size());
  Index i = 0;
  for (const BodyPeaks &peak : body_peaks_) {
    peaks.segment<7>(i) << peak.velocity, peak.angular_velocity, peak.modal, peak.modal_velocity, peak.acceleration,
        peak.angular_acceleration, peak.modal_acceleration;
    i += 7;
  }
  peaks.tail(multiplier_peaks_.size()) = multiplier_peaks_;
  return peaks;
}

void ConstrainedMotion::restore(const Eigen::VectorXd &gathered) {
  const double *peak = gathered.data();
  for (BodyPeaks &of : body_peaks_) {
    of = {peak[0], peak[1], peak[2], peak[3], peak[4], peak[5], peak[6]};
    peak += 7;
  }
  multiplier_peaks_ = gathered.tail(multiplier_peaks_.size());
}

void ConstrainedMotion::factorise(double damping_factor, double stiffness_factor) {
  if (!real_)
    real_ = std::make_unique<IterationMatrix<double>>(system_);
  real_->factorise(workspace_, damping_, damping_factor, stiffness_, stiffness_factor);
}

void ConstrainedMotion::factorise(Complex damping_factor, Complex stiffness_factor) {
  if (!complex_)
    complex_ = std::make_unique<IterationMatrix<Complex>>(system_);
  complex_->factorise(workspace_, damping_, damping_factor, stiffness_, stiffness_factor);
}

void ConstrainedMotion::constraint_values(double t, const double *y, double *value, double *rate) {
  constraint_residuals(system_, t, y, y + system_.coordinates, workspace_, value, rate);
}

// Whether every motion that the constraints allow has positive kinetic energy, at the last evaluation. Geometric
// stiffening takes p^T K_omega p off m_thetatheta: more, for a link bent far, than its modes leave. M has then a
// negative pivot, and is still positive on C_q v = 0 just where C M^-1 C^T has as many (Sylvester's law of inertia).
bool ConstrainedMotion::has_inertia() const {
  Index negative = 0;
  for (const auto &state : workspace_.bodies)
    negative += (state.D_inverse.array() < 0).count();
  return negative == 0 || negative == workspace_.schur.negative_pivots();
}

// Small deformations end long before the mean square of a body's deflection, p^T p / m, is that of its radius.
bool ConstrainedMotion::is_sensible(const double *y) const {
  for (std::size_t b = 0; b < system_.bodies.size(); ++b) {
    const PlanarBody &body = system_.bodies[b];
    if (!(VectorMap(y + system_.first_coordinate[b] + 3, body.modes()).squaredNorm() <= body.inertia))
      return false;
  }
  return has_inertia();
}

double ConstrainedMotion::initial_step() const {
  double fastest = rate_;
  for (const auto &omega : frequency_)
    if (omega.size())
      fastest = std::max(fastest, omega.maxCoeff());
  return 0.1 / fastest;
}

} // namespace ffrobot
