// What a run delivers: outputs at given times, the recording of its steps, and samples of them.
#pragma once

#include "core/integrate/integrate.h"

namespace ffrobot {

class Delivery {
public:
  // `times` in s, ascending; `recording` and `samples` may be null.
  Delivery(OdeSystem &system, const std::vector<double> &times, const StateFunctionOfTime &output, Recording *recording,
           Samples *samples)
      : system_(system), times_(times), output_(output), recording_(recording), samples_(samples),
        z_output_(system.size()) {}

  std::size_t outputs() const { return outputs_; }
  void go_on(std::size_t outputs) { outputs_ = outputs; }
  bool is_complete() const { return outputs_ == times_.size(); }
  double next_time() const { return times_[outputs_]; }

  // The next output, with the local coordinates z (ode.h).
  void output(const double *z) {
    output_(outputs_, times_[outputs_], state(z));
    ++outputs_;
  }
  // Those up to t, with the same z.
  void outputs_at(double t, const double *z);
  // Those within a step that ends at t, its end among them.
  void outputs_of_step(Method &method, double t);

  void record(double t, const double *z);
  // Of a step of size h from (t, z), which the method has just made; slopes at its end are as they were.
  void sample_step(Method &method, double t, const double *z, double h, double end);
  void sample(double t, const double *z);
  void record_method(const MethodChoice &method); // that of the steps from the last recorded time on

private:
  const double *state(const double *z) const { return system_.local().state(z); }

  OdeSystem &system_;
  const std::vector<double> &times_;
  const StateFunctionOfTime &output_;
  Recording *recording_;
  Samples *samples_;
  std::size_t outputs_ = 0;
  Eigen::VectorXd z_output_;
};

} // namespace ffrobot
