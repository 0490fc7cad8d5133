#include "core/integrate/watch.h"

#include "core/integrate/step_control.h"

#include <algorithm>
#include <cmath>

namespace ffrobot {

namespace {

constexpr unsigned long steps_between_questions = 1000;
constexpr std::chrono::milliseconds time_between_questions{200}; // where steps take long

// A step size that collapses never quite reaches rounding where noise feeds its estimates. Nothing that the equations
// describe asks for a thousand steps in a row so much shorter, in the mean, than the first one to try, a tenth of the
// fastest vibration's radian.
constexpr double shortest_steps = 1e-5;

} // namespace

// The clock is looked at after one step, two, four and so on while that takes next to no time.
bool Watch::is_time_to_ask(unsigned long taken) {
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

IntegrationStatus Watch::look(double t, double next_step, unsigned long taken) {
  if (max_steps_ && taken >= max_steps_)
    return IntegrationStatus::too_many_steps;
  bool collapsed = next_step < no_time * std::max(std::abs(t), end_ - t);
  const bool counted = taken % steps_between_questions == 0;
  if ((counted || is_time_to_ask(taken)) && !carry_on_(t))
    return IntegrationStatus::interrupted;
  if (counted) {
    const double mean_step = (t - t_asked_) / static_cast<double>(steps_between_questions);
    collapsed = collapsed || (taken > 0 && mean_step < shortest_steps * system_.initial_step());
    t_asked_ = t;
  }
  return collapsed ? IntegrationStatus::step_underflow : IntegrationStatus::completed;
}

} // namespace ffrobot
