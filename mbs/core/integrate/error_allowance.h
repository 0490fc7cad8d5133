// How large the error of a step may be: its share of the tolerance, and what a reserve adds to it.
#pragma once

namespace ffrobot {

constexpr double rounding_of_errors = 2e-14; // what error estimates see of it: shorter steps would not help

// What the size of the next step follows from.
struct StepHistory {
  double next_step = 0;                         // s
  double usual_step = 0;                        // s, the largest of the last ones
  double reserve = 1;                           // what is left of it, in terms of the tolerance
  double previous_step = 0, previous_error = 1; // s, and relative to the largest error allowed; of StepControl
  bool in_transient = false;                    // vibrations of the start are still being damped away
  int without_look = 0;                         // tries to come that are not looked at for rounding
};

// Of one step: as parts of the tolerance, without and with the reserve, and in the unit of errors.
struct Allowance {
  double regular_part, part;
  double regular_error, error;
  double to_iterate; // what the iterations of the step are measured by
};

// For a `step`, in s, whose regular share of the `tolerance` is `regular_part`.
Allowance allowance_of(double step, double regular_part, const StepHistory &steps, double tolerance);

// Takes what an accepted step needs from the reserve in `steps`. `size` is its error relative to the largest one
// allowed; returned is that for the control of the next step, which should do without the reserve.
double take_from_reserve(double step, const Allowance &allowance, double size, StepHistory &steps);

} // namespace ffrobot
