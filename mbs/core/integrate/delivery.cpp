#include "core/integrate/delivery.h"

#include <algorithm>
#include <cmath>

namespace ffrobot {

void Delivery::outputs_at(double t, const double *z) {
  while (!is_complete() && next_time() <= t)
    output(z);
}

void Delivery::outputs_of_step(Method &method, double t) {
  while (!is_complete() && next_time() < t) {
    method.interpolate(next_time(), z_output_.data());
    output(z_output_.data());
  }
  outputs_at(t, method.end());
}

void Delivery::record(double t, const double *z) {
  if (!recording_)
    return;
  const double *y = state(z);
  recording_->times.push_back(t);
  recording_->states.insert(recording_->states.end(), y, y + system_.local().state_size());
}

void Delivery::sample_step(Method &method, double t, const double *z, double h, double end) {
  if (!samples_)
    return;
  const int parts = std::max(samples_->parts, static_cast<int>(std::ceil(h / samples_->longest)));
  if (parts > 1) {
    method.prepare_dense(t, z, h);
    for (int i = 1; i < parts; ++i) {
      method.interpolate(t + i * h / parts, z_output_.data());
      sample(t + i * h / parts, z_output_.data());
    }
    if (method.needs_slopes_between()) // the system is where it was
      system_.slope(end, method.end(), method.last_slope());
  }
  if (++samples_->steps % samples_->every == 0)
    sample(end, method.end());
}

void Delivery::sample(double t, const double *z) {
  if (!samples_)
    return;
  auto &[longest, most, parts, times, states, steps, every] = *samples_;
  const std::size_t n = system_.local().state_size();
  if (times.size() >= most) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < times.size(); i += 2, ++kept) {
      times[kept] = times[i];
      std::copy_n(states.begin() + static_cast<std::ptrdiff_t>(i * n), n,
                  states.begin() + static_cast<std::ptrdiff_t>(kept * n));
    }
    times.resize(kept), states.resize(kept * n);
    every *= 2;
  }
  if (times.empty())
    states.reserve(most * n); // memory that is never reached costs nothing; that of copies while it grows does
  const double *y = state(z);
  times.push_back(t);
  states.insert(states.end(), y, y + n);
  for (std::size_t i = 0; i < n; i += 8) // where the next one goes, which no cache has
    __builtin_prefetch(states.data() + states.size() + i, 1);
}

void Delivery::record_method(const MethodChoice &method) {
  if (recording_)
    recording_->methods.emplace_back(recording_->times.size() - 1, method);
}

} // namespace ffrobot
