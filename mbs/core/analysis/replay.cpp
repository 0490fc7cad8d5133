#include "core/analysis/replay.h"

#include <algorithm>

namespace ffrobot {

using Eigen::Index;

ActuationSource::ActuationSource(const System &system, std::vector<bool> is_trajectory,
                                 std::optional<ActuatorForces> resolver)
    : is_trajectory_(std::move(is_trajectory)), resolver_(std::move(resolver)) {
  for (const auto &body : system.bodies)
    modal_zero_.emplace_back(Eigen::VectorXd::Zero(body.modes()));
  modal_force_ = modal_zero_;
}

void ActuationSource::resolve() {
  if (!resolver_)
    return;
  resolver_->resolve(workspace());
  tau_ = resolver_->tau();
  for (std::size_t b = 0; b < modal_force_.size(); ++b)
    modal_force_[b] = resolver_->modal_force()[b] + shape_force()[b];
}

RecordedMotion::RecordedMotion(const System &system, const Recording &recording)
    : motion_(system, {}, {}, nullptr), recording_(recording) {
  motion_.plan(recording.times.back() - recording.times.front());
  constexpr int remembered = 4;
  for (int i = 0; i < remembered; ++i)
    cache_.push_back({static_cast<std::size_t>(-1), make_method(recording.method, motion_)});
}

void RecordedMotion::state(double t, double *y) {
  const auto &times = recording_.times;
  const std::size_t last = times.size() - 2;
  hint_ = std::min(hint_, last);
  while (hint_ < last && t > times[hint_ + 1])
    ++hint_;
  while (hint_ > 0 && t < times[hint_])
    --hint_;
  auto found = std::find_if(cache_.begin(), cache_.end(), [&](const Interval &i) { return i.index == hint_; });
  if (found == cache_.end()) {
    found = cache_.begin() + static_cast<std::ptrdiff_t>(next_);
    next_ = (next_ + 1) % cache_.size();
    found->index = hint_;
    const Index n = motion_.size();
    const double *start = recording_.states.data() + static_cast<std::size_t>(n) * hint_;
    const double t0 = times[hint_], h = times[hint_ + 1] - t0;
    Method &method = *found->method;
    motion_.slope(t0, start, method.first_slope());
    motion_.accepted(t0, start, method.first_slope()); // peaks, which iterations measure themselves by
    method.step(t0, start, h, 1e-3 * recording_.tolerance);
    std::copy_n(start + n, n, method.end());
    motion_.slope(t0 + h, start + n, method.last_slope());
    method.prepare_dense(t0, start, h);
  }
  found->method->interpolate(t, y);
}

RecordedActuation::RecordedActuation(const System &system, const Recording &recording, std::vector<bool> is_trajectory,
                                     std::optional<ActuatorForces> resolver)
    : ActuationSource(system, std::move(is_trajectory), std::move(resolver)), system_(system),
      motion_(system, recording), workspace_(system), y_(2 * system.coordinates), a_(system.coordinates) {}

void RecordedActuation::find(double t) {
  motion_.state(t, y_.data());
  accelerations(system_, t, y_.data(), y_.data() + system_.coordinates, workspace_, a_.data());
  q_ = y_.head(system_.coordinates);
  resolve();
}

FullyConstrainedActuation::FullyConstrainedActuation(const System &system, std::vector<ModalShape> shape,
                                                     Eigen::VectorXd guess, std::vector<bool> is_trajectory,
                                                     std::optional<ActuatorForces> resolver)
    : ActuationSource(system, std::move(is_trajectory), std::move(resolver)), system_(system),
      motion_(system, std::move(guess)), shape_(std::move(shape)) {}

void FullyConstrainedActuation::find(double t) {
  motion_.set_shape(t, shape_);
  motion_.solve(t); // was found at all output times before; a failure in between shows as a step that is refused
  resolve();
}

} // namespace ffrobot
