#include "core/integrate/error_allowance.h"

#include <algorithm>

namespace ffrobot {

namespace {

// The reserve is a second tolerance, as large as the first, for errors that happen once and not at every step. There
// are two kinds. A load that jumps leaves an error in proportion to the step across it, more than that step's share of
// the tolerance however short it is: steps that are that much shorter than the usual ones may take from the reserve. A
// small part of it, as estimates may see a twentieth of a jump late in a step; a larger one where steps near rounding.
// Vibrations below the tolerance that a step damps away are gone after it: a method that damps begins with the longest
// step there is, and may take from the reserve until these are gone.
constexpr double much_shorter = 1e-3, part_at_jump = 0.03;
constexpr double near_rounding = 1e-8, part_of_reserve = 0.25;

// Part of the tolerance that the iterations of a step are measured by at least. The share of very short steps is below
// the noise of forces, which no iteration gets through: they would stay as short as they are.
constexpr double least_to_iterate = 1e-4;

} // namespace

Allowance allowance_of(double step, double regular_part, const StepHistory &steps, double tolerance) {
  const double of_reserve = steps.in_transient || step < near_rounding * steps.usual_step ? part_of_reserve
                            : step < much_shorter * steps.usual_step                      ? part_at_jump
                                                                                          : 0.0;
  const double part = std::max(regular_part, of_reserve * steps.reserve);
  const double regular_error = std::max(tolerance * regular_part, rounding_of_errors);
  const double error = std::max(tolerance * part, rounding_of_errors);
  const double to_iterate = std::max(steps.in_transient ? regular_error : error, least_to_iterate * tolerance);
  return {regular_part, part, regular_error, error, to_iterate};
}

double take_from_reserve(double step, const Allowance &allowance, double size, StepHistory &steps) {
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

} // namespace ffrobot
