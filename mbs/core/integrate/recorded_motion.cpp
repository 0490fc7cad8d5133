#include "core/integrate/recorded_motion.h"

namespace ffrobot {

RecordedMotion::RecordedMotion(OdeSystem &motion, const Recording &recording)
    : motion_(motion), recording_(recording), z_(motion_.size()), slope_(motion_.size()), end_slope_(motion_.size()) {
  constexpr int remembered = 4;
  cache_.resize(remembered);
}

const double *RecordedMotion::recorded(std::size_t i) const {
  return recording_.states.data() + motion_.local().state_size() * i;
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

void RecordedMotion::set_off(Step &step) {
  const MethodChoice &choice = recording_.method_of(hint_);
  if (!step.method || step.kind != choice.kind)
    step.method = make_method(choice, motion_);
  step.kind = choice.kind;
  step.index = hint_;
  step.begin = recording_.times[hint_];
  step.length = recording_.times[hint_ + 1] - step.begin;
}

// The run's own iteration began at what the step before extrapolates to; this one begins at the start of the step, with
// the geometry of a step that it made for another time. Where it does not get to a thousandth of the tolerance,
// geometry is taken anew, then what the run was content with has to do.
bool RecordedMotion::iterate_again(const Step &step) {
  for (const double share : {1e-3, 1e-3, 1e-2, 1.})
    if (step.method->step(step.begin, z_.data(), step.length, share * recording_.tolerance))
      return true;
  return false;
}

void RecordedMotion::make_again(Step &step) {
  set_off(step);
  Method &method = *step.method;
  const double t0 = step.begin, h = step.length;
  motion_.local().from_state(recorded(hint_), z_.data());
  motion_.slope(t0, z_.data(), method.first_slope());
  motion_.accepted(t0, z_.data(), method.first_slope()); // peaks, which iterations measure themselves by
  step.is_made = iterate_again(step);
  step.start = z_;
  motion_.local().from_state(recorded(hint_ + 1), method.end());
  motion_.slope(t0 + h, method.end(), method.last_slope());
  method.prepare_dense(t0, z_.data(), h);
}

// Hermite's cubic through the recorded ends and their slopes, where the step cannot be made again.
void RecordedMotion::between_ends(const Step &step, double t) {
  const auto vector = [&](const double *x) { return Map<const VectorXd>(x, z_.size()); };
  Method &method = *step.method;
  z_ = hermite((t - step.begin) / step.length, step.length, step.start, vector(method.end()),
               vector(method.first_slope()), vector(method.last_slope()));
}

const double *RecordedMotion::evaluated(double t) {
  motion_.slope(t, z_.data(), slope_.data());
  return motion_.local().state(z_.data());
}

const double *RecordedMotion::at_end(std::size_t i) {
  motion_.local().set_centre(recorded(i));
  motion_.local().from_state(recorded(i), z_.data());
  const double *state = evaluated(recording_.times[i]);
  end_ = i, end_slope_ = slope_;
  return state;
}

bool RecordedMotion::is_stage(int i, double t) const {
  return t == followed_.method->stage_time(i, followed_.begin, followed_.length);
}

void RecordedMotion::set_stage_times(const double *times, int count) {
  stages_ = 0;
  find_interval(times[0]);
  set_off(followed_);
  Method &method = *followed_.method;
  if (count != method.stages())
    return;
  for (int i = 0; i < count; ++i)
    if (!is_stage(i, times[i]))
      return;
  if (end_ != hint_)
    at_end(hint_);
  motion_.local().set_centre(recorded(hint_));
  followed_.start.resize(z_.size());
  motion_.local().from_state(recorded(hint_), followed_.start.data());
  std::copy_n(end_slope_.data(), end_slope_.size(), method.first_slope());
  motion_.set_stage_times(times, count);
  next_stage_ = 0, stages_ = count;
}

double RecordedMotion::end_of_step(double t, double h) {
  // Longer steps are left to reserves of the error; shorter ones cost less than dense output where they begin at the
  // end of a recorded step, and lead to the end of one where they do not.
  constexpr double longest = 1.1, shortest = 0.6, shortest_on_the_way = 0.9;
  find_interval(t);
  const auto &times = recording_.times;
  if (t == times[hint_ + 1] && hint_ + 2 < times.size())
    ++hint_;
  set_off(followed_);
  const double way = times[hint_ + 1] - t;
  const bool fits = way <= longest * h && way >= (t == times[hint_] ? shortest : shortest_on_the_way) * h;
  return fits && followed_.method->stages() > 0 ? times[hint_ + 1] : t + h;
}

const double *RecordedMotion::state(double t) {
  is_at_stage_ = next_stage_ < stages_ && is_stage(next_stage_, t);
  if (is_at_stage_)
    return motion_.local().state(
        followed_.method->stage(next_stage_++, followed_.begin, followed_.start.data(), followed_.length));
  stages_ = 0;
  find_interval(t);
  for (const std::size_t i : {hint_, hint_ + 1})
    if (t == recording_.times[i])
      return at_end(i);
  motion_.local().set_centre(recorded(hint_));
  auto found = std::find_if(cache_.begin(), cache_.end(), [&](const Step &step) { return step.index == hint_; });
  if (found == cache_.end()) {
    found = cache_.begin() + static_cast<std::ptrdiff_t>(next_);
    next_ = (next_ + 1) % cache_.size();
    make_again(*found);
  }
  if (found->is_made)
    found->method->interpolate(t, z_.data());
  else
    between_ends(*found, t);
  return evaluated(t);
}

} // namespace ffrobot
