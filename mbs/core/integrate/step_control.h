// Step control by the digital filter H211b, b = 8 (G. Soderlind, ACM Trans. Math. Softw. 29, 2003): the elementary
// controller rejects every third step where fast vibration makes the error scatter.
#pragma once

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
  double after_accepted(double step, double error) {
    constexpr double b = 8;
    error = std::max(error, 1e-12);
    const double before = previous_step_ > 0 ? previous_error_ : error;
    double factor = std::pow(square(target) / (error * before), 1 / (b * order_));
    if (previous_step_ > 0)
      factor *= std::sqrt(std::sqrt(std::sqrt(previous_step_ / step))); // to the power of 1/b
    previous_step_ = step;
    previous_error_ = error;
    return step * (1 + std::atan(factor - 1));
  }

  double after_rejected(double step, double error) const {
    constexpr double smallest_factor = 0.2, largest_factor = 0.9;
    if (!std::isfinite(error))
      return step * smallest_factor;
    return step * std::clamp(std::pow(target / error, 1 / order_), smallest_factor, largest_factor);
  }

  // The last accepted step, with which a run goes on.
  double previous_step() const { return previous_step_; }
  double previous_error() const { return previous_error_; }
  void go_on(double previous_step, double previous_error) {
    previous_step_ = previous_step;
    previous_error_ = previous_error;
  }

private:
  static double square(double x) { return x * x; }

  double order_;
  double previous_step_ = 0, previous_error_ = 1;
};

} // namespace ffrobot
