#include "core/motion.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace ffrobot {

using Eigen::Index;
using VectorMap = Eigen::Map<const Eigen::VectorXd>;

ConstrainedMotion::ConstrainedMotion(const System &system, std::vector<int> group, std::vector<bool> moment,
                                     Steering *steering)
    : system_(system), workspace_(system), group_(std::move(group)), steering_(steering),
      body_peaks_(system.bodies.size()), lambda_(workspace_.lambda), shifted_(2 * system.coordinates),
      shifted_slope_(2 * system.coordinates) {
  const int groups = group_.empty() ? 0 : *std::max_element(group_.begin(), group_.end()) + 1;
  multiplier_peaks_.assign(static_cast<std::size_t>(groups), 0.0);
  group_is_moment_.assign(static_cast<std::size_t>(groups), false);
  for (std::size_t r = 0; r < group_.size(); ++r)
    group_is_moment_[static_cast<std::size_t>(group_[r])] = moment[r];
  for (const auto &body : system.bodies) {
    for (const auto &position : body.marker_positions)
      length_ = std::max(length_, position.norm());
    frequency_.push_back(body.stiffness.cwiseSqrt());
  }
  if (length_ == 0)
    length_ = 1;
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

double ConstrainedMotion::error_size(double t, const double *y, const double *e) {
  const Index n = system_.coordinates;
  double size = 0;
  for (std::size_t b = 0; b < system_.bodies.size(); ++b) {
    const Index i = system_.first_coordinate[b], modes = system_.bodies[b].modes();
    const double *d = e + i, *d_dot = e + n + i;
    const BodyPeaks &peak = body_peaks_[b];
    size = std::max({size, std::hypot(d[0], d[1]) / length_, std::abs(d[2]),
                     std::hypot(d_dot[0], d_dot[1]) / peak.velocity, std::abs(d_dot[2]) / peak.angular_velocity});
    if (modes > 0) {
      // A robot at rest under gravity: p_dot starts from nothing, with the rounding of K p integrated over a period.
      const double rounding =
          32 * std::numeric_limits<double>::epsilon() * frequency_[b].cwiseProduct(VectorMap(y + i + 3, modes)).norm();
      size = std::max({size, VectorMap(d + 3, modes).norm() / peak.modal,
                       (VectorMap(d_dot + 3, modes).norm() - rounding) / peak.modal_velocity});
    }
  }
  // Forces amplify errors of the state (stiffness times the error of a fast mode): measure what e does to them.
  lambda_ = workspace_.lambda;
  has_lambda_ = true;
  if (group_.empty())
    return size;
  shifted_ = VectorMap(y, 2 * n) + VectorMap(e, 2 * n);
  slope(t, shifted_.data(), shifted_slope_.data());
  double largest = 0;
  for (std::size_t g = 0; g < multiplier_peaks_.size(); ++g)
    largest = std::max(largest, multiplier_peaks_[g] / (group_is_moment_[g] ? length_ : 1.0));
  for (std::size_t g = 0; g < multiplier_peaks_.size(); ++g) {
    double error = 0, now = 0;
    for (std::size_t r = 0; r < group_.size(); ++r)
      if (group_[r] == static_cast<int>(g)) {
        const auto i = static_cast<Index>(r);
        error += std::pow(workspace_.lambda[i] - lambda_[i], 2);
        now += lambda_[i] * lambda_[i];
      }
    const double floor = 1e-3 * largest * (group_is_moment_[g] ? length_ : 1.0);
    const double scale = std::max({multiplier_peaks_[g], std::sqrt(now), floor});
    if (error > 0)
      size = std::max(size, std::sqrt(error) / scale);
    else if (!(error == 0))
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
  const auto raise = [](double &peak, double value) { peak = std::max(peak, value); };
  for (std::size_t b = 0; b < system_.bodies.size(); ++b) {
    const Index i = system_.first_coordinate[b], modes = system_.bodies[b].modes();
    const double *v = y + n + i, *a = dy + n + i;
    BodyPeaks &peak = body_peaks_[b];
    // floors: a hundredth of a length (a radian) per second; the vibration that the accelerations would start
    raise(peak.velocity, std::max(std::hypot(v[0], v[1]), 0.01 * length_));
    raise(peak.angular_velocity, std::max(std::abs(v[2]), 0.01));
    if (modes > 0) {
      const auto &omega = frequency_[b];
      const VectorMap p(y + i + 3, modes), p_dot(v + 3, modes), p_ddot(a + 3, modes);
      applied_ = applied_modal_force(b).cwiseQuotient(omega); // may hold the links straight: p stays zero then
      raise(peak.modal, std::max({p.norm(), p_ddot.cwiseQuotient(omega).cwiseQuotient(omega).norm(),
                                  applied_.cwiseQuotient(omega).norm(), 1e-12}));
      raise(peak.modal_velocity, std::max({p_dot.norm(), p_ddot.cwiseQuotient(omega).norm(), applied_.norm(), 1e-12}));
    }
  }
  const Eigen::VectorXd &lambda = has_lambda_ ? lambda_ : workspace_.lambda;
  for (std::size_t g = 0; g < multiplier_peaks_.size(); ++g) {
    double square = 0;
    for (std::size_t r = 0; r < group_.size(); ++r)
      if (group_[r] == static_cast<int>(g))
        square += std::pow(lambda[static_cast<Index>(r)], 2);
    raise(multiplier_peaks_[g], std::sqrt(square));
  }
}

double ConstrainedMotion::initial_step() const {
  double fastest = 1;
  for (const auto &omega : frequency_)
    if (omega.size())
      fastest = std::max(fastest, omega.maxCoeff());
  return 0.1 / fastest;
}

} // namespace ffrobot
