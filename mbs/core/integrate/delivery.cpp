#include "core/integrate/delivery.h"

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

void Delivery::record_method(const MethodChoice &method) {
  if (recording_)
    recording_->methods.emplace_back(recording_->times.size() - 1, method);
}

} // namespace ffrobot
