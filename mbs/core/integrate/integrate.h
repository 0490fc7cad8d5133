// Adaptive integration with output at given times, written against the system and the method only by what ode.h and
// method.h say.
#pragma once

#include "core/integrate/method.h"
#include "core/integrate/ode.h"

#include <functional>
#include <vector>

namespace ffrobot {

// The accepted steps of a run: with them its dense output can be made again at any time (see replay.h).
struct Recording {
  std::vector<double> times;
  std::vector<double> states; // one after the other
  MethodChoice method;
  double tolerance = 0;
};

// Where a run has stopped, and all that its next step depends on. Explicit methods go on as if nothing had been; what
// implicit ones extrapolate from earlier steps is lost.
struct Checkpoint {
  double time = 0;
  Eigen::VectorXd state;    // empty: the run has not begun
  Eigen::VectorXd stepping; // step size, of late the largest, reserve, previous step, its error, in_transient
  Eigen::VectorXd gathered; // of the system
  std::size_t outputs = 0;  // delivered
};

enum class IntegrationStatus {
  completed,
  step_underflow, // no step size meets the tolerance
  too_many_steps,
  interrupted, // by the caller
  diverged,    // beyond what the equations describe
};

struct IntegrationReport {
  IntegrationStatus status = IntegrationStatus::completed;
  double time = 0; // reached
  unsigned long steps = 0, rejected = 0, evaluations = 0;
  std::size_t outputs = 0; // delivered
};

struct IntegrationControls {
  double tolerance = 1e-6;
  unsigned long max_steps = 0; // 0: no limit
  MethodChoice method;
};

// Times, ascending, at which loads jump: steps end there, and `at` is told index, time and state before the next
// begins.
struct Breaks {
  std::vector<double> times;
  std::function<void(std::size_t, double, const double *)> at;
};

// Integrates y from times.front() to times.back() and calls output(i, t, y) at every entry of times, in order.
// carry_on(t) is asked every thousand steps, and about five times a second. y ends at the last accepted step. `breaks`
// may be null. A `checkpoint` of an earlier call with the same `times` has the run go on from there: neither outputs
// nor the `recording`, which has to be the same, begin again, and max_steps counts anew. It ends as that of this call.
IntegrationReport integrate(ImplicitSystem &system, const std::vector<double> &times, Eigen::VectorXd &y,
                            const IntegrationControls &controls,
                            const std::function<void(std::size_t, double, const double *)> &output,
                            const std::function<bool(double)> &carry_on, Recording *recording,
                            const Breaks *breaks = nullptr, Checkpoint *checkpoint = nullptr);

} // namespace ffrobot
