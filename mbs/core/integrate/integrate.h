// Adaptive integration with output at given times, written against the system and the method only by what ode.h and
// method.h say.
#pragma once

#include "core/integrate/faster_method.h"
#include "core/integrate/limit_watch.h"
#include "core/integrate/step_control.h"

#include <functional>
#include <utility>

namespace ffrobot {

// The accepted steps of a run: with them its dense output can be made again at any time (see replay.h).
struct Recording {
  std::vector<double> times;  // s
  std::vector<double> states; // (q, v) of each, one after the other
  double tolerance = 0;
  std::vector<std::pair<std::size_t, MethodChoice>> methods; // from the step that begins at times[first] on

  const MethodChoice &method_of(std::size_t step) const;

  FFROBOT_FIELDS(times, states, tolerance, methods);
};

// States within a run, closer than its outputs: ends of steps, and times between them where steps are longer than
// `longest`, so that each step has `parts` at least. With more than `most` of them every other one is dropped, and of
// later steps every second end taken, then every fourth. A run that goes on with an earlier one goes on with its
// samples.
struct Samples {
  double longest;                     // s
  std::size_t most;                   // at least 2
  int parts = 1;                      // of each step, at least
  std::vector<double> times{};        // s
  std::vector<double> states{};       // (q, v) of each, one after the other
  unsigned long steps = 0, every = 1; // made so far; of them, the ends that are taken

  FFROBOT_FIELDS(longest, most, parts, times, states, steps, every);
};

// Where an integration has stopped, and all that its next step depends on: the same candidates given, it goes on with
// the method that was at work. Explicit ones go on as if nothing had been; what implicit ones extrapolate from earlier
// steps is lost.
struct IntegrationCheckpoint {
  double time = 0; // s
  VectorXd state;  // (q, v); empty: the integration has not begun
  StepHistory steps;
  std::size_t outputs = 0; // delivered
  MethodHistory methods;

  bool has_begun() const { return state.size() > 0; }

  FFROBOT_FIELDS(time, state, steps, outputs, methods);
};

enum class IntegrationStatus {
  completed,
  step_underflow, // no step size meets the tolerance
  too_many_steps,
  interrupted, // by the caller
  diverged,    // beyond what the equations describe
};

struct MethodChange {
  double time; // s
  MethodKind from, to;
  double mean_step; // s, of the one before
};

struct IntegrationReport {
  IntegrationStatus status = IntegrationStatus::completed;
  double time = 0; // s, reached
  unsigned long steps = 0, rejected = 0, evaluations = 0;
  std::size_t outputs = 0; // delivered
  double last_step = 0;    // s, tried
  double last_error = 0;   // of it, relative to the largest one allowed; NaN where its equations could not be solved
  double rounding = 0;     // what rounding may have added to errors of accepted steps, in the unit of the tolerance
  std::vector<MethodChange> changes;
  std::vector<double> step_ends; // s, as controls ask for them; empty where the run cannot be repeated by them
};

struct IntegrationControls {
  double tolerance = 1e-6;
  unsigned long max_steps = 0;        // 0: no limit
  std::vector<Candidate> methods{{}}; // one, or two of which the faster is found out

  std::vector<double> stops; // s, ascending: steps end there, too, so that none passes what happens between two

  // Whether ends of steps are reported, if one explicit method makes the whole run without breaks and jumps; and those
  // of such a run, whose steps are taken again with the first method: no step is rejected, no error estimated. Then the
  // result depends on parameters of the system as smoothly as its slopes do, and differences of such runs have no noise
  // but rounding (internal numerical differentiation: H. G. Bock, Springer Series in Chemical Physics 18, 1981).
  bool keep_steps = false;
  std::vector<double> repeated_steps; // s, ascending; empty: steps are as the tolerance wants them
};

using StateFunctionOfTime = std::function<void(std::size_t, double, const double *)>; // of number, time and (q, v)

// Times, ascending, at which loads jump: steps end there, and `at` receives index, time and state before the next
// begins.
struct Breaks {
  std::vector<double> times;
  StateFunctionOfTime at;
};

// What goes along with an integration; any may be null. `limits` looks at all steps.
struct Companions {
  Recording *recording = nullptr;
  const Breaks *breaks = nullptr;
  IntegrationCheckpoint *checkpoint = nullptr;
  LimitWatch *limits = nullptr;
  Samples *samples = nullptr;
};

// Integrates y = (q, v) from times.front() to times.back() and calls output(i, t, y) at every entry of times, in order.
// carry_on(t) is asked every thousand steps, and about five times a second. y ends at the last accepted step.
// Of a checkpoint that has begun in an earlier call with the same `times` the integration goes on: neither outputs nor
// the recording, which has to be the same, begin again, and max_steps counts anew; `limits` has to go on as well. It
// ends as that of this call.
IntegrationReport integrate(OdeSystem &system, const std::vector<double> &times, VectorXd &y,
                            const IntegrationControls &controls, const StateFunctionOfTime &output,
                            const std::function<bool(double)> &carry_on, const Companions &with = {});

} // namespace ffrobot
