#include "core/integrate/recorded_motion.h"

#include <algorithm>

namespace ffrobot {

using Eigen::Index;
using Eigen::VectorXd;

RecordedMotion::RecordedMotion(ImplicitSystem &motion, const Recording &recording)
    : motion_(motion), recording_(recording), z_(motion_.size()), slope_(motion_.size()) {}

const double *RecordedMotion::recorded(std::size_t i) const {
  return recording_.states.data() + static_cast<std::size_t>(motion_.local().state_size()) * i;
}

void RecordedMotion::find_interval(double t) {
  const auto &times = recording_.times;
  const std::size_t last = times.size() - 2;
  interval_ = std::min(interval_, last);
  while (interval_ < last && t > times[interval_ + 1])
    ++interval_;
  while (interval_ > 0 && t < times[interval_])
    --interval_;
}

// The run's own iteration began at what the step before extrapolates to; this one begins at the start of the step, with
// the geometry of a step that it made for another time. Where it does not get to a thousandth of the tolerance,
// geometry is taken anew, then what the run was content with has to do.
bool RecordedMotion::iterate_again() {
  for (const double share : {1e-3, 1e-3, 1e-2, 1.})
    if (step_.method->step(step_.begin, z_.data(), step_.length, share * recording_.tolerance))
      return true;
  return false;
}

void RecordedMotion::make_again() {
  const MethodChoice &choice = recording_.method_of(interval_);
  if (!step_.method || step_.kind != choice.kind)
    step_.method = make_method(choice, motion_);
  step_.kind = choice.kind;
  step_.index = interval_;
  const double t = step_.begin = recording_.times[interval_], end = recording_.times[interval_ + 1];
  step_.length = end - t;
  Method &method = *step_.method;
  motion_.local().from_state(recorded(interval_), z_.data());
  motion_.slope(t, z_.data(), method.first_slope());
  motion_.accepted(t, z_.data(), method.first_slope()); // peaks, which iterations measure themselves by
  step_.is_made = iterate_again();
  step_.start = z_;
  motion_.local().from_state(recorded(interval_ + 1), method.end());
  motion_.slope(end, method.end(), method.last_slope());
  method.prepare_dense(t, z_.data(), step_.length);
}

// Hermite's cubic through the recorded ends and their slopes, where the step cannot be made again.
void RecordedMotion::between_ends(double t) {
  using Values = Eigen::Map<const VectorXd>;
  Method &method = *step_.method;
  const Index n = z_.size();
  const double x = (t - step_.begin) / step_.length, left = 1 - x;
  z_ = left * left * (1 + 2 * x) * step_.start + x * x * (3 - 2 * x) * Values(method.end(), n) +
       step_.length * x * left * (left * Values(method.first_slope(), n) - x * Values(method.last_slope(), n));
}

const double *RecordedMotion::evaluated(double t) {
  motion_.slope(t, z_.data(), slope_.data());
  return motion_.local().state(z_.data());
}

const double *RecordedMotion::state(double t) {
  find_interval(t);
  for (const std::size_t i : {interval_, interval_ + 1})
    if (t == recording_.times[i]) {
      motion_.local().set_centre(recorded(i));
      motion_.local().from_state(recorded(i), z_.data());
      return evaluated(t);
    }
  motion_.local().set_centre(recorded(interval_));
  if (step_.index != interval_)
    make_again();
  if (step_.is_made)
    step_.method->interpolate(t, z_.data());
  else
    between_ends(t);
  return evaluated(t);
}

} // namespace ffrobot
