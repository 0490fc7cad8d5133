// A run of which the ends of steps are known, at any time: samples at fixed times would alias the fast modes.
#pragma once

#include "core/integrate/integrate.h"
#include "core/integrate/method.h"

#include <memory>

namespace ffrobot {

// Between them there is the dense output of the step, made again.
class RecordedMotion {
public:
  // `motion`: a system as the one that was recorded, which nothing else moves. Both must outlive this.
  RecordedMotion(ImplicitSystem &motion, const Recording &recording);
  RecordedMotion(const RecordedMotion &) = delete;
  RecordedMotion &operator=(const RecordedMotion &) = delete;

  // (q, v), valid until the next call, at which the last slope of `motion` is afterwards. Times had best ascend.
  const double *state(double t);

private:
  const double *recorded(std::size_t i) const; // state i
  void find_interval(double t);                // interval_
  void make_again();                           // the step there, by the method that made it
  bool iterate_again();
  void between_ends(double t);       // into z_
  const double *evaluated(double t); // z_

  ImplicitSystem &motion_;
  const Recording &recording_;
  std::size_t interval_ = 0;

  struct Step { // between two recorded states
    std::size_t index = static_cast<std::size_t>(-1);
    MethodKind kind = MethodKind::dop853;
    std::unique_ptr<Method> method;
    double begin = 0, length = 0;
    Eigen::VectorXd start;
    bool is_made = true; // else iterations did not converge
  };
  Step step_;
  Eigen::VectorXd z_, slope_;
};

} // namespace ffrobot
