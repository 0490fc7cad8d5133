#include "core/integrate/faster_method.h"

#include <utility>

namespace ffrobot {

namespace {

// Found with the runs of tests/campaigns/choice.py.
constexpr unsigned long first_window = 150;      // steps between measurements, twice as many after each change but
                                                 // for the first: what happens once in a run slows both
constexpr unsigned long first_trial = 1500;      // steps before the other method is tried,
constexpr unsigned long trials_apart = 4;        // how much later each time,
constexpr unsigned long sooner_if_preferred = 4; // and how much sooner where it is taken to be faster
constexpr double worth_changing = 1.25, worth_changing_damped = 6; // times as fast
constexpr double not_worth_trying = 12;                            // times as slow, as expected

} // namespace

FasterMethod::FasterMethod(std::vector<Candidate> candidates, double start, double end)
    : candidates_(std::move(candidates)), end_(end) {
  history_.since = history_.measured = start;
  history_.window = first_window;
  history_.trial = first_trial;
  if (candidates_.size() > 1)
    history_.pace_of_other = other().pace;
}

void FasterMethod::go_on(const MethodHistory &history) {
  history_ = history;
  history_.second = history.second && candidates_.size() > 1;
  history_.window = std::max(history.window, 1ul);
}

// Steps from the last measurement to this one; 0 where there is none now.
unsigned long FasterMethod::steps_measured() const {
  const auto tries = history_.tries, window = history_.window;
  if (tries == first_window)
    return first_window;
  if (tries % window != 0)
    return 0;
  return tries == window && window > first_window ? window - first_window : window;
}

bool FasterMethod::takes_over(double t, bool damps) {
  if (candidates_.size() < 2)
    return false;
  ++history_.tries;
  const auto steps = steps_measured();
  if (steps == 0)
    return false;
  const double since_last = (t - history_.measured) / (static_cast<double>(steps) * now().cost);
  history_.measured = t;
  const bool slow = since_last * (damps ? worth_changing_damped : worth_changing) < history_.pace_of_other;
  const auto trial = history_.pace_of_other > since_last ? history_.trial / sooner_if_preferred : history_.trial;
  const bool is_tried = history_.tries >= trial && end_ - t > t - history_.since; // not near the end
  if (!slow && !is_tried)
    return false;
  mean_step_ = (t - history_.since) / static_cast<double>(history_.tries);
  const double pace = mean_step_ / now().cost;
  history_.since = t;
  history_.tries = 0;
  if (is_tried)
    history_.trial *= trials_apart;
  if (is_tried && pace > not_worth_trying * other().pace)
    return false;
  history_.pace_of_other = since_last; // beside the first of the next: what is hard or easy later slows or speeds both
  history_.window *= 2;
  history_.second = !history_.second;
  return true;
}

} // namespace ffrobot
