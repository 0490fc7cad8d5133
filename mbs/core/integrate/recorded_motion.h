// The dense output of a run of which the ends of steps are known: samples at fixed times would alias the fast modes.
#pragma once

#include "core/integrate/integrate.h"
#include "core/integrate/method.h"

#include <memory>

namespace ffrobot {

// The state of a recorded run at any time, by making the step around it again.
class RecordedMotion {
public:
  // `motion`: a system as the one that was recorded, which nothing else moves. Both must outlive this.
  RecordedMotion(ImplicitSystem &motion, const Recording &recording);
  RecordedMotion(const RecordedMotion &) = delete;
  RecordedMotion &operator=(const RecordedMotion &) = delete;

  const double *state(double t); // (q, v); valid until the next call

private:
  struct Interval { // between two recorded states
    std::size_t index = static_cast<std::size_t>(-1);
    MethodKind kind = MethodKind::dop853;
    std::unique_ptr<Method> method;
    bool is_step = true; // else iterations did not converge
    double begin = 0, length = 0;
    Eigen::VectorXd start;
  };

  const double *recorded(std::size_t i) const; // state i
  void find_interval(double t);                // that of hint_
  void make_again(Interval &interval);         // the step of the interval, by the method that made it
  bool step_again(Method &method, double t0, double h);
  void between_ends(const Interval &interval, double t); // into z_

  ImplicitSystem &motion_;
  const Recording &recording_;
  std::size_t hint_ = 0;
  std::vector<Interval> cache_; // the stages of a step visit a few recorded steps in turn
  std::size_t next_ = 0;
  Eigen::VectorXd z_;
};

} // namespace ffrobot
