#include "core/replay.h"

#include <algorithm>

namespace ffrobot {

using Eigen::Index;

RecordedMotion::RecordedMotion(const System &system, const Recording &recording)
    : motion_(system, {}, {}, nullptr), recording_(recording) {
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

ReplayedActuation::ReplayedActuation(const System &inverse, const Recording &recording, ActuationResolver resolver,
                                     std::vector<bool> trajectory, AppliedActuation applied,
                                     std::vector<Eigen::MatrixXd> projector)
    : inverse_(inverse), motion_(inverse, recording), resolver_(std::move(resolver)), workspace_(inverse),
      trajectory_(std::move(trajectory)), applied_(applied), projector_(std::move(projector)),
      y_(2 * inverse.coordinates), a_(inverse.coordinates) {}

void ReplayedActuation::steer(double t, Workspace &forward) {
  motion_.state(t, y_.data());
  accelerations(inverse_, t, y_.data(), y_.data() + inverse_.coordinates, workspace_, a_.data());
  if (applied_ == AppliedActuation::trajectory) {
    std::size_t drive = 0;
    for (std::size_t r = 0; r < trajectory_.size(); ++r)
      if (trajectory_[r])
        forward.external_drive[drive++] = -workspace_.lambda[static_cast<Index>(r)];
    return;
  }
  resolver_.resolve(workspace_);
  for (Index i = 0; i < resolver_.tau().size(); ++i)
    forward.external_drive[static_cast<std::size_t>(i)] = resolver_.tau()[i];
  if (applied_ == AppliedActuation::joints_and_patches) {
    forward.has_external_modal = true;
    for (std::size_t b = 0; b < projector_.size(); ++b)
      if (projector_[b].size())
        forward.external_modal[b].noalias() = projector_[b] * resolver_.modal_force()[b];
  }
}

} // namespace ffrobot
