// What a run delivers: outputs at given times, the recording of its steps, and samples of them.
#pragma once

#include "core/integrate/integrate.h"

#include <cmath>

namespace ffrobot {

class Delivery {
public:
  // `times` in s, ascending; `recording` and `samples` may be null. States z below are local coordinates (ode.h).
  Delivery(OdeSystem &system, const std::vector<double> &times, const StateFunctionOfTime &output, Recording *recording,
           Samples *samples)
      : system_(system), times_(times), output_(output), recording_(recording), samples_(samples),
        z_output_(system.size()) {}

  std::size_t outputs() const { return outputs_; }
  void go_on(std::size_t outputs) { outputs_ = outputs; }
  bool is_complete() const { return outputs_ == times_.size(); }
  double next_time() const { return times_[outputs_]; }

  void output(const double *z) { // the next one
    output_(outputs_, times_[outputs_], state(z));
    ++outputs_;
  }
  // Those up to t, with the same z
  void outputs_at(double t, const double *z) {
    while (!is_complete() && next_time() <= t)
      output(z);
  }
  // Those within a step that ends at t, its end among them
  void outputs_of_step(Method &method, double t) {
    while (!is_complete() && next_time() < t) {
      method.interpolate(next_time(), z_output_.data());
      output(z_output_.data());
    }
    outputs_at(t, method.end());
  }

  void record(double t, const double *z) {
    if (!recording_)
      return;
    const double *y = state(z);
    recording_->times.push_back(t);
    recording_->states.insert(recording_->states.end(), y, y + system_.local().state_size());
  }
  // That of the steps from the last recorded time on
  void record_method(const MethodChoice &method) {
    if (recording_)
      recording_->methods.emplace_back(recording_->times.size() - 1, method);
  }

  // Of a step of size h from (t, z), which the method has just made; slopes at its end are as they were.
  void sample_step(Method &method, double t, const double *z, double h, double end) {
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
  void sample(double t, const double *z) {
    if (!samples_)
      return;
    auto &[longest, most, parts, times, states, steps, every] = *samples_;
    const std::size_t n = system_.local().state_size();
    if (times.size() >= most) {
      std::size_t kept = 0;
      for (std::size_t i = 0; i < times.size(); i += 2, ++kept) {
        times[kept] = times[i];
        std::copy_n(states.data() + i * n, n, states.data() + kept * n);
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

private:
  const double *state(const double *z) const { return system_.local().state(z); }

  OdeSystem &system_;
  const std::vector<double> &times_;
  const StateFunctionOfTime &output_;
  Recording *recording_;
  Samples *samples_;
  std::size_t outputs_ = 0;
  VectorXd z_output_;
};

} // namespace ffrobot
