// What the constraint equations of a scene follow, found for all stages of a step at once.
#pragma once

#include "core/recursion/motion/scene.h"
#include "core/time_function/functions_of_time.h"

#include <limits>

namespace ffrobot::recursion {

class ConstraintLaws {
public:
  // Equations without a target stay where they are.
  ConstraintLaws(const Scene &scene, std::size_t equations);

  // The next times will be these (count).
  void set_stage_times(const double *times, int count) {
    find(times, count);
    time_ = nowhere;
  }

  // What follows is of time t afterwards; false where it was before.
  bool go_to(double t) {
    if (t == time_)
      return false;
    now_ = next_;
    if (now_ >= times_.size() || times_[now_] != t)
      look_up(t);
    next_ = now_ + 1;
    time_ = t;
    now_accelerations_ = accelerations_.data() + now_ * sign_.size();
    return true;
  }
  const double *accelerations() const { return now_accelerations_; } // (equations)
  Jet of(std::size_t equation) const {
    const Jet law = laws_.jet(now_, equation);
    const double sign = sign_[equation];
    return {sign * law.value, sign * law.rate, sign * law.acceleration};
  }

private:
  static constexpr double nowhere = std::numeric_limits<double>::quiet_NaN();
  void look_up(double t); // now_
  void find(const double *times, int count);

  FunctionsOfTime laws_; // up to their signs, at times_
  VectorXd sign_;
  std::vector<double> times_, accelerations_; // (times, equations)
  std::size_t next_ = 0, now_ = 0;            // of these times: most likely asked for next; time_
  double time_ = nowhere;
  const double *now_accelerations_ = nullptr;
};

} // namespace ffrobot::recursion
