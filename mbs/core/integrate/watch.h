// Whether a run may go on: its limit of steps, steps that collapse, the wish of the caller.
#pragma once

#include "core/integrate/integrate.h"

#include <chrono>

namespace ffrobot {

class Watch {
public:
  // From `start` to `end`, in s. Asks carry_on(t) every thousand steps, and about five times a second. `max_steps` as
  // in IntegrationControls.
  Watch(OdeSystem &system, double start, double end, unsigned long max_steps,
        const std::function<bool(double)> &carry_on)
      : system_(system), end_(end), max_steps_(max_steps), carry_on_(carry_on), t_asked_(start) {}

  void begin_at(double t) { t_asked_ = t; }

  // How the run ends at t, before its next step, so many being taken; `completed` where it may go on.
  IntegrationStatus look(double t, double next_step, unsigned long taken);

private:
  bool is_time_to_ask(unsigned long taken);

  OdeSystem &system_;
  double end_;
  unsigned long max_steps_;
  const std::function<bool(double)> &carry_on_;
  double t_asked_;
  std::chrono::steady_clock::time_point asked_ = std::chrono::steady_clock::now(), looked_ = asked_;
  unsigned long next_look_ = 0, steps_between_looks_ = 1;
};

} // namespace ffrobot
