// Step control by the digital filter H211b, b = 8 (G. Soderlind, ACM Trans. Math. Softw. 29, 2003): the elementary
// controller rejects every third step where fast vibration makes the error scatter.
#pragma once

#include "core/fields.h"

#include <algorithm>
#include <cmath>

namespace ffrobot {

constexpr double rounding_of_errors = 2e-14; // what error estimates see of it: shorter steps would not help

// What the size of the next step follows from.
struct StepHistory {
  double next_step = 0;                         // s
  double usual_step = 0;                        // s, the largest of the last ones
  double reserve = 1;                           // what is left of it, in terms of the tolerance
  double previous_step = 0, previous_error = 1; // s, and relative to the largest error allowed
  bool in_transient = false;                    // vibrations of the start are still being damped away
  int without_look = 0;                         // tries to come that are not looked at for rounding

  FFROBOT_FIELDS(next_step, usual_step, reserve, previous_step, previous_error, in_transient, without_look);
};

// Of one step: as parts of the tolerance, without and with the reserve, and in the unit of errors.
struct Allowance {
  double regular_part, part;
  double regular_error, error;
  double to_iterate; // what the iterations of the step are measured by
};

// For a `step`, in s, whose regular share of the `tolerance` is `regular_part`.
inline Allowance allowance_of(double step, double regular_part, const StepHistory &steps, double tolerance) {
  // The reserve is a second tolerance, as large as the first, for errors that happen once and not at every step. There
  // are two kinds. A load that jumps leaves an error in proportion to the step across it, more than that step's share
  // of the tolerance however short it is: steps that are that much shorter than the usual ones may take from the
  // reserve. A small part of it, as estimates may see a twentieth of a jump late in a step; a larger one where steps
  // near rounding. Vibrations below the tolerance that a step damps away are gone after it: a method that damps begins
  // with the longest step there is, and may take from the reserve until these are gone.
  constexpr double much_shorter = 1e-3, part_at_jump = 0.03;
  constexpr double near_rounding = 1e-8, part_of_reserve = 0.25;

  // Part of the tolerance that the iterations of a step are measured by at least. The share of very short steps is
  // below the noise of forces, which no iteration gets through: they would stay as short as they are.
  constexpr double least_to_iterate = 1e-4;

  const double of_reserve = steps.in_transient || step < near_rounding * steps.usual_step ? part_of_reserve
                            : step < much_shorter * steps.usual_step                      ? part_at_jump
                                                                                          : 0.0;
  const double part = std::max(regular_part, of_reserve * steps.reserve);
  const double regular_error = std::max(tolerance * regular_part, rounding_of_errors);
  const double error = std::max(tolerance * part, rounding_of_errors);
  const double to_iterate = std::max(steps.in_transient ? regular_error : error, least_to_iterate * tolerance);
  return {regular_part, part, regular_error, error, to_iterate};
}

// Takes what an accepted step needs from the reserve in `steps`. `size` is its error relative to the largest one
// allowed; returned is that for the control of the next step, which should do without the reserve.
inline double take_from_reserve(double step, const Allowance &allowance, double size, StepHistory &steps) {
  steps.usual_step = std::max(step, 0.95 * steps.usual_step);
  if (allowance.part > allowance.regular_part &&
      (!steps.in_transient || size * allowance.error > allowance.regular_error))
    steps.reserve -= size * allowance.part;
  if (steps.in_transient) {
    size *= allowance.error / allowance.regular_error;
    steps.in_transient = size > 1;
  }
  return size;
}

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
