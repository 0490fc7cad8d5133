// How long steps may be where functions of time bend: error estimates see them only at the stages of a step, and where
// nothing moves a step can be longer than a load takes to come and go.
#pragma once

#include "core/integrate/ode.h"

#include <vector>

namespace ffrobot {

// With the functions f(t) that the system is prescribed, relative to their range, a step h from t is to keep
//
//   h * integral of |f''| from t to t + h  <=  4,
//
// for each: half a period of a sine, a third of a hump, to a sample before what jumps. The integral is that of a
// thousand samples of the run: what comes and goes between two of them is not seen, and no step is made shorter than
// some of their intervals.
class StepLimit {
public:
  // A function that changes by less than `tolerance`, relative to its largest value, limits nothing.
  StepLimit(OdeSystem &system, double start, double end, double tolerance);

  double of(double t, double step) const; // the step, or a shorter one

private:
  double bend_before(std::size_t sample) const { return sample ? bend_[sample - 1] : 0; }

  double start_, interval_;
  std::vector<double> bend_; // 1/s, up to and with each sample; empty where nothing bends
};

} // namespace ffrobot
