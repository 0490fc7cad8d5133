// Whether a run may go on: its limit of steps, steps that collapse, the wish of the caller.
#pragma once

#include "core/integrate/integrate.h"
#include "core/integrate/step_control.h"

#include <chrono>

namespace ffrobot {

class Watch {
public:
  // From `start` to `end`, in s. Asks carry_on(t) every thousand steps, and about five times a second. `max_steps` as
  // in IntegrationControls.
  Watch(OdeSystem &system, double start, double end, unsigned long max_steps,
        const std::function<bool(double)> &carry_on)
      : system_(system), end_(end), brief_(1e-4 * (end - start)), max_steps_(max_steps), carry_on_(carry_on),
        t_asked_(start) {}

  void begin_at(double t) { t_asked_ = t; }

  // How the run ends at t, before its next step, so many being taken; `completed` where it may go on.
  IntegrationStatus look(double t, double next_step, unsigned long taken) {
    if (max_steps_ && taken >= max_steps_)
      return IntegrationStatus::too_many_steps;
    bool collapsed = next_step < no_time * std::max(std::abs(t), end_ - t);
    const bool counted = taken % steps_between_questions == 0;
    if ((counted || is_time_to_ask(taken)) && !carry_on_(t))
      return IntegrationStatus::interrupted;
    if (counted) {
      const double mean_step = (t - t_asked_) / static_cast<double>(steps_between_questions);
      collapsed = collapsed || (taken > 0 && mean_step < shortest_steps * std::min(system_.initial_step(), brief_));
      t_asked_ = t;
    }
    return collapsed ? IntegrationStatus::step_underflow : IntegrationStatus::completed;
  }

private:
  static constexpr unsigned long steps_between_questions = 1000;
  static constexpr std::chrono::milliseconds time_between_questions{200}; // where steps take long

  // A step size that collapses never quite reaches rounding where noise feeds its estimates. Nothing that the equations
  // describe asks for a thousand steps in a row so much shorter, in the mean, than the first one to try, a tenth of the
  // fastest vibration's radian. Where nothing vibrates that is a part of the run.
  static constexpr double shortest_steps = 1e-5;

  // The clock is looked at after one step, two, four and so on while that takes next to no time.
  bool is_time_to_ask(unsigned long taken) {
    if (taken < next_look_)
      return false;
    const auto now = std::chrono::steady_clock::now();
    steps_between_looks_ =
        now - looked_ < time_between_questions / 20 ? std::min(2 * steps_between_looks_, steps_between_questions) : 1;
    next_look_ = taken + steps_between_looks_;
    looked_ = now;
    if (now - asked_ <= time_between_questions)
      return false;
    asked_ = now;
    return true;
  }

  OdeSystem &system_;
  double end_, brief_; // s
  unsigned long max_steps_;
  const std::function<bool(double)> &carry_on_;
  double t_asked_;
  std::chrono::steady_clock::time_point asked_ = std::chrono::steady_clock::now(), looked_ = asked_;
  unsigned long next_look_ = 0, steps_between_looks_ = 1;
};

} // namespace ffrobot
