// Which of two methods gets further for the same work, found out while an integration runs.
#pragma once

#include "core/integrate/method.h"

namespace ffrobot {

// A method for an integration, and what is expected of it.
struct Candidate {
  MethodChoice method;
  double cost = 1; // of a step that is tried, in a unit that all candidates share
  double pace = 0; // s of the run per cost
};

// What the choice follows from, besides the candidates.
struct MethodHistory {
  bool second = false;      // at work, not the first
  double pace_of_other = 0; // as expected, later as found
  double since = 0;         // s: where the one at work began, or was last compared
  double measured = 0;      // s: where its pace was measured last
  unsigned long tries = 0;  // steps that it has tried from `since` on
  unsigned long window = 0; // of them, between measurements
  unsigned long trial = 0;  // of them, before the other is tried

  FFROBOT_FIELDS(second, pace_of_other, since, measured, tries, window, trial);
};

// What is expected of a method may be wrong, and one that was slow may do better when vibrations have died out. The
// other takes over where the one at work is slower than the other is expected, or was found, to be; and it is tried
// now and then, less and less often.
class FasterMethod {
public:
  // One candidate is at work for good; of two, the first begins. The run is from `start` to `end`.
  FasterMethod(std::vector<Candidate> candidates, double start, double end);

  const MethodChoice &at_work() const { return now().method; }
  const MethodChoice &before() const { return other().method; }

  // A step was tried, and the run has got to t. True where the other method takes over. `damps`: Method::damps() of the
  // one at work, which gets faster when it has damped vibrations away.
  bool takes_over(double t, bool damps);

  double mean_step() const { return mean_step_; } // s, of the one that was at work before

  const MethodHistory &history() const { return history_; }
  void go_on(const MethodHistory &history); // of a run with the same candidates

private:
  unsigned long steps_measured() const;
  const Candidate &now() const { return candidates_[history_.second ? 1 : 0]; }
  const Candidate &other() const { return candidates_[history_.second ? 0 : 1]; }

  std::vector<Candidate> candidates_;
  double end_;
  MethodHistory history_;
  double mean_step_ = 0;
};

} // namespace ffrobot
