// What of a step's error estimate is rounding of its states.
#pragma once

#include "core/integrate/ode.h"

namespace ffrobot {

class Rounding {
public:
  explicit Rounding(OdeSystem &system);

  // The error that slopes of states apart by their rounding leave in a step of `step` s from (t, z) with the slope
  // z_dot; zero where that is no notable part of `error`. Stiff springs between angles make it, where nothing moves and
  // nothing else is as large; what they leave in rates moves coordinates during the step. It is in proportion to the
  // step, as is the part of the tolerance that one step of many may take: no shorter step would do better. Takes one
  // slope; none for some calls after one that found next to nothing. Valid until the next call.
  const Eigen::VectorXd &error(double t, const double *z, const double *z_dot, double step,
                               const Eigen::VectorXd &error);

private:
  OdeSystem &system_;
  Eigen::ArrayXd shift_; // (n) factors of a state's entries
  Eigen::VectorXd shifted_, left_;
  int resting_ = 0; // calls without a look
};

} // namespace ffrobot
