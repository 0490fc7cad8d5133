#include "core/system/error_norm.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace ffrobot {

using Eigen::Index;
using VectorMap = Eigen::Map<const Eigen::VectorXd>;

namespace {

constexpr double small_moment = 0.1; // of what the largest force makes at a link's length
constexpr double slowest = 0.01; // lengths (radians) in the time that counts: rates below are not worth comparing with

} // namespace

ErrorNorm::ErrorNorm(const System &system, Judged judged)
    : system_(system), joints_(std::move(judged.joints)), motors_(judged.motors),
      multipliers_(static_cast<Index>(judged.group.size())), group_(std::move(judged.group)) {
  multiplier_groups_ =
      group_.empty() ? 0 : static_cast<std::size_t>(*std::max_element(group_.begin(), group_.end()) + 1);
  per_force_.assign(multiplier_groups_, 1);
  for (std::size_t r = 0; r < group_.size(); ++r)
    if (judged.moment[r])
      per_force_[static_cast<std::size_t>(group_[r])] = system.length;
  const auto add_group = [&](double per_force) { // of one value
    group_.push_back(static_cast<int>(per_force_.size()));
    per_force_.push_back(per_force);
  };
  for (std::size_t i = 0; i < joints_.size(); ++i)
    add_group(0);
  if (motors_)
    for (const Measure &motor : motors_->motors())
      add_group(carries_moment(motor.kind) ? system.length : 1);
  peaks_.bodies.resize(system.bodies.size());
  peaks_.groups = group_now_ = group_error_ = Eigen::VectorXd::Zero(static_cast<Index>(per_force_.size()));
  for (const PlanarBody &body : system.bodies)
    frequency_.push_back(body.stiffness.cwiseSqrt());
}

void ErrorNorm::plan(double duration) {
  rate_ = std::max(1 / duration, std::sqrt(system_.gravity.norm() / system_.length));
}

double ErrorNorm::of_state(const double *z, const double *e) const {
  const Index n = system_.n_v();
  double size = 0;
  for (std::size_t b = 0; b < system_.bodies.size(); ++b) {
    const Index i = system_.first_coordinate[b], modes = system_.bodies[b].modes();
    const double *d = e + i, *d_dot = e + n + i;
    const BodyPeaks &peak = peaks_.bodies[b];
    size = std::max({size, std::hypot(d[0], d[1]) / system_.length, std::abs(d[2]),
                     std::hypot(d_dot[0], d_dot[1]) / peak.velocity, std::abs(d_dot[2]) / peak.angular_velocity});
    if (modes > 0) {
      // Velocities of the modes as what they are of the body's, and as the deflections that they turn into. A robot at
      // rest under gravity: p_dot starts from nothing, with the rounding of K p integrated over a period.
      const VectorMap p(z + i + 3, modes), e_p(d + 3, modes), e_p_dot(d_dot + 3, modes);
      const double rounding = 32 * std::numeric_limits<double>::epsilon() * frequency_[b].cwiseProduct(p).norm();
      size = std::max({size, e_p.norm() / peak.modal, e_p_dot.cwiseQuotient(frequency_[b]).norm() / peak.modal,
                       (e_p_dot.norm() - rounding) / peak.modal_velocity});
    }
    if (!(size < std::numeric_limits<double>::infinity()))
      return NAN;
  }
  return size;
}

double ErrorNorm::of_change(const double *z, const double *change, double rate) const {
  const Index n = system_.n_v();
  double size = of_state(z, change);
  for (std::size_t b = 0; b < system_.bodies.size(); ++b) {
    const double *d = change + n + system_.first_coordinate[b];
    const BodyPeaks &peak = peaks_.bodies[b];
    const double accelerations =
        std::max({std::hypot(d[0], d[1]) / peak.acceleration, std::abs(d[2]) / peak.angular_acceleration,
                  VectorMap(d + 3, system_.bodies[b].modes()).norm() / peak.modal_acceleration});
    size = rate * accelerations <= size ? size : rate * accelerations; // keeps NaN
  }
  return size;
}

void ErrorNorm::observe(const Workspace &w, Eigen::VectorXd &values) {
  values.setZero(static_cast<Index>(group_.size()));
  values.head(multipliers_) = w.lambda.head(multipliers_);
  rates_of_joints(w, values);
  if (has_small_moments()) {
    const Eigen::VectorXd &tau = motors_->tau_of(w.lambda, w);
    values.tail(tau.size()) = tau;
  }
}

// Or what little would move the bodies, where nothing has happened yet.
double ErrorNorm::largest_force() const {
  double largest = 0;
  for (std::size_t b = 0; b < system_.bodies.size(); ++b)
    largest += system_.bodies[b].mass * peaks_.bodies[b].acceleration;
  for (std::size_t g = 0; g < multiplier_groups_; ++g)
    largest = std::max(largest, peaks_.groups[static_cast<Index>(g)] / per_force_[g]);
  return largest;
}

// Others are about as good as the forces that they stand for, for less work.
bool ErrorNorm::has_small_moments() const {
  if (!motors_)
    return false;
  const double force = small_moment * largest_force();
  for (std::size_t g = per_force_.size() - motors_->motors().size(); g < per_force_.size(); ++g)
    if (peaks_.groups[static_cast<Index>(g)] <= force * per_force_[g])
      return true;
  return false;
}

void ErrorNorm::rates_of_joints(const Workspace &w, Eigen::VectorXd &values) const {
  MeasureMotion motion;
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    evaluate(joints_[i], w.bodies, motion);
    values[multipliers_ + static_cast<Index>(i)] = motion.rate;
  }
}

// The size of each force or moment that the values are components of.
void ErrorNorm::measure_groups(const Eigen::VectorXd &values, Eigen::VectorXd &size) const {
  size.setZero();
  for (std::size_t r = 0; r < group_.size(); ++r)
    size[group_[r]] += std::pow(values[static_cast<Index>(r)], 2);
  size = size.cwiseSqrt();
}

double ErrorNorm::of_observed(const Eigen::VectorXd &values, const Workspace &w) {
  observe(w, change_);
  change_ -= values;
  double size = 0;
  const double largest = largest_force();
  measure_groups(values, group_now_);
  measure_groups(change_, group_error_);
  for (std::size_t g = 0; g < per_force_.size(); ++g) {
    const auto i = static_cast<Index>(g);
    const double least = per_force_[g] > 0 ? 1e-3 * largest * per_force_[g] : slowest * rate_;
    const double scale = std::max({peaks_.groups[i], group_now_[i], least});
    if (group_error_[i] > 0)
      size = std::max(size, group_error_[i] / scale);
    else if (!(group_error_[i] == 0))
      return NAN;
  }
  return size;
}

// Of applied loads on the modes of body b, at the last evaluation.
Eigen::VectorXd ErrorNorm::applied_modal_force(std::size_t b, const Workspace &w) const {
  const PlanarBodyState &state = w.bodies[b];
  Eigen::VectorXd F_p = state.modal_load;
  if (state.has_wrench)
    add_modal_force(system_.bodies[b], state, state.wrench, F_p);
  return F_p;
}

void ErrorNorm::take(const double *z, const double *z_dot, const Eigen::VectorXd &observed, const Workspace &w) {
  const Index n = system_.n_v();
  const double length = system_.length;
  const auto raise = [](double &peak, double value) { peak = std::max(peak, value); };
  for (std::size_t b = 0; b < system_.bodies.size(); ++b) {
    const Index i = system_.first_coordinate[b], modes = system_.bodies[b].modes();
    const double *v = z + n + i, *a = z_dot + n + i;
    BodyPeaks &peak = peaks_.bodies[b];
    // floors, and the vibration that accelerations would start
    const double slow = slowest * rate_;
    raise(peak.velocity, std::max(std::hypot(v[0], v[1]), slow * length));
    raise(peak.angular_velocity, std::max(std::abs(v[2]), slow));
    raise(peak.acceleration, std::max({std::hypot(a[0], a[1]), system_.gravity.norm(), slow * rate_ * length}));
    raise(peak.angular_acceleration, std::max(std::abs(a[2]), peak.acceleration / length));
    peak.modal_acceleration = std::max(peak.modal_acceleration, std::sqrt(system_.bodies[b].mass) * peak.acceleration);
    if (modes > 0) {
      const auto &omega = frequency_[b];
      const VectorMap p(z + i + 3, modes), p_dot(v + 3, modes), p_ddot(a + 3, modes);
      // where nothing has happened yet: a thousandth of what the acceleration would do to the softest mode
      const double force = std::sqrt(system_.bodies[b].mass) * peak.acceleration;
      applied_ = applied_modal_force(b, w).cwiseQuotient(omega); // may hold the links straight: p stays zero then
      raise(peak.modal, std::max({p.norm(), p_ddot.cwiseQuotient(omega).cwiseQuotient(omega).norm(),
                                  applied_.cwiseQuotient(omega).norm(), 1e-3 * force / std::pow(omega.minCoeff(), 2)}));
      // A coordinate that the constraints carry along faster than its own frequency has large accelerations: little of
      // what they are worth as vibration, enough for a start at rest.
      raise(peak.modal_velocity, std::max({p_dot.norm(), 0.01 * p_ddot.cwiseQuotient(omega).norm(), applied_.norm(),
                                           std::sqrt(system_.bodies[b].mass) * peak.velocity}));
    }
  }
  measure_groups(observed, group_now_);
  peaks_.groups = peaks_.groups.cwiseMax(group_now_);
}

double ErrorNorm::fastest() const {
  double fastest = rate_;
  for (const auto &omega : frequency_)
    if (omega.size())
      fastest = std::max(fastest, omega.maxCoeff());
  return fastest;
}

} // namespace ffrobot
