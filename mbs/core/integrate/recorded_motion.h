// A run of which the ends of steps are known, at any time: samples at fixed times would alias the fast modes.
#pragma once

#include "core/integrate/integrate.h"

namespace ffrobot {

// Another run that depends on it is best off with its steps: both are one system then, of which each step is made by
// one method, stage by stage (`set_stage_times`). At any other time there is the dense output of the step around it,
// made again.
class RecordedMotion {
public:
  // `motion`: a system as the one that was recorded, which nothing else moves. Both must outlive this.
  RecordedMotion(OdeSystem &motion, const Recording &recording);
  RecordedMotion(const RecordedMotion &) = delete;
  RecordedMotion &operator=(const RecordedMotion &) = delete;

  // (q, v), valid until the next call, at which the last slope of `motion` is afterwards.
  const double *state(double t);
  bool is_at_stage() const { return is_at_stage_; } // of a step: at this time there are other states, too

  // The next times will be the stages (count) of a step. If it is a recorded one, states are those of its stages.
  void set_stage_times(const double *times, int count);

  // The end of a recorded step, if one ends about there.
  double end_of_step(double t, double h);

private:
  struct Step { // between two recorded states
    std::size_t index = -1;
    MethodKind kind = MethodKind::dop853;
    std::unique_ptr<Method> method;
    double begin = 0, length = 0;
    VectorXd start;
    bool is_made = true; // else iterations did not converge
  };

  const double *recorded(std::size_t i) const; // state i
  void find_interval(double t);                // hint_
  void set_off(Step &step);                    // its method, from the start of the interval
  void make_again(Step &step);                 // the whole step, by the method that made it
  bool iterate_again(const Step &step);
  void between_ends(const Step &step, double t); // into z_
  const double *at_end(std::size_t i);           // of a step
  const double *evaluated(double t);             // z_
  bool is_stage(int i, double t) const;          // of the step that is followed

  OdeSystem &motion_;
  const Recording &recording_;
  std::size_t hint_ = 0;
  std::vector<Step> cache_; // the stages of a step visit a few recorded steps in turn
  std::size_t next_ = 0;
  Step followed_; // stage by stage
  int next_stage_ = 0, stages_ = 0;
  bool is_at_stage_ = false;
  std::size_t end_ = -1; // of a step, of which the slope is known
  VectorXd z_, slope_, end_slope_;
};

} // namespace ffrobot
