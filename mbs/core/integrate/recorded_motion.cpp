#include "core/integrate/recorded_motion.h"

#include <algorithm>

namespace ffrobot {

using Eigen::Index;

RecordedMotion::RecordedMotion(ImplicitSystem &motion, const Recording &recording)
    : motion_(motion), recording_(recording), z_(motion_.size()) {
  constexpr int remembered = 4;
  cache_.resize(remembered);
}

const double *RecordedMotion::recorded(std::size_t i) const {
  return recording_.states.data() + static_cast<std::size_t>(motion_.local().state_size()) * i;
}

void RecordedMotion::find_interval(double t) {
  const auto &times = recording_.times;
  const std::size_t last = times.size() - 2;
  hint_ = std::min(hint_, last);
  while (hint_ < last && t > times[hint_ + 1])
    ++hint_;
  while (hint_ > 0 && t < times[hint_])
    --hint_;
}

// The run's own iteration began at what the step before extrapolates to; this one begins at the start of the step, with
// the geometry of a step that it made for another time. Where it does not get to a thousandth of the tolerance,
// geometry is taken anew, then what the run was content with has to do.
bool RecordedMotion::step_again(Method &method, double t0, double h) {
  for (const double share : {1e-3, 1e-3, 1e-2, 1.})
    if (method.step(t0, z_.data(), h, share * recording_.tolerance))
      return true;
  return false;
}

void RecordedMotion::make_again(Interval &interval) {
  const MethodChoice &choice = recording_.method_of(hint_);
  if (!interval.method || interval.kind != choice.kind)
    interval.method = make_method(choice, motion_);
  interval.kind = choice.kind;
  interval.index = hint_;
  Method &method = *interval.method;
  const double t0 = recording_.times[hint_], h = recording_.times[hint_ + 1] - t0;
  motion_.local().from_state(recorded(hint_), z_.data());
  motion_.slope(t0, z_.data(), method.first_slope());
  motion_.accepted(t0, z_.data(), method.first_slope()); // peaks, which iterations measure themselves by
  interval.is_step = step_again(method, t0, h);
  interval.begin = t0;
  interval.length = h;
  interval.start = z_;
  motion_.local().from_state(recorded(hint_ + 1), method.end());
  motion_.slope(t0 + h, method.end(), method.last_slope());
  method.prepare_dense(t0, z_.data(), h);
}

// Hermite's cubic through the recorded ends and their slopes, where the step cannot be made again.
void RecordedMotion::between_ends(const Interval &interval, double t) {
  using Values = Eigen::Map<const Eigen::VectorXd>;
  Method &method = *interval.method;
  const Index n = z_.size();
  const double x = (t - interval.begin) / interval.length, left = 1 - x;
  z_ = left * left * (1 + 2 * x) * interval.start + x * x * (3 - 2 * x) * Values(method.end(), n) +
       interval.length * x * left * (left * Values(method.first_slope(), n) - x * Values(method.last_slope(), n));
}

const double *RecordedMotion::state(double t) {
  find_interval(t);
  motion_.local().set_centre(recorded(hint_));
  auto found = std::find_if(cache_.begin(), cache_.end(), [&](const Interval &i) { return i.index == hint_; });
  if (found == cache_.end()) {
    found = cache_.begin() + static_cast<std::ptrdiff_t>(next_);
    next_ = (next_ + 1) % cache_.size();
    make_again(*found);
  }
  if (found->is_step)
    found->method->interpolate(t, z_.data());
  else
    between_ends(*found, t);
  return motion_.local().state(z_.data());
}

} // namespace ffrobot
