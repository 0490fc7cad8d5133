// Step control by the digital filter H211b, b = 8 (G. Soderlind, ACM Trans. Math. Softw. 29, 2003): the elementary
// controller rejects every third step where fast vibration makes the error scatter.
#pragma once

#include "core/integrate/error_allowance.h"

#include <algorithm>
#include <cmath>

namespace ffrobot {

constexpr double no_time = 1e-13; // of the time, or of the run: no step is made for it

class StepControl {
public:
  static constexpr double target = 0.25; // of the largest error allowed: leaves room for its scatter

  // order: the error shrinks as step^order
  explicit StepControl(double order) : order_(order) {}

  // Size of the next step; error relative to the largest one allowed.
  double after_accepted(double step, double error, StepHistory &steps) const {
    constexpr double b = 8;
    error = std::max(error, 1e-12);
    const double before = steps.previous_step > 0 ? steps.previous_error : error;
    double factor = std::pow(target * target / (error * before), 1 / (b * order_));
    if (steps.previous_step > 0)
      factor *= std::sqrt(std::sqrt(std::sqrt(steps.previous_step / step))); // to the power of 1/b
    steps.previous_step = step, steps.previous_error = error;
    return step * (1 + std::atan(factor - 1));
  }

  double after_rejected(double step, double error) const {
    constexpr double smallest_factor = 0.2, largest_factor = 0.9;
    if (!std::isfinite(error))
      return step * smallest_factor;
    return step * std::clamp(std::pow(target / error, 1 / order_), smallest_factor, largest_factor);
  }

private:
  double order_;
};

} // namespace ffrobot
