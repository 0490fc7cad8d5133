// What of a step's error estimate is rounding of its states.
#pragma once

#include "core/integrate/method.h"

namespace ffrobot {

class Rounding {
public:
  explicit Rounding(OdeSystem &system);

  // The error that rounding of slopes leaves in the `error` that `method` has estimated of its step of `step` s from
  // (t, z) with the slope z_dot; zero where that is no notable part of it. It is in proportion to the step, as is the
  // part of the tolerance that one step of many may take: no shorter step would do better. Three kinds are looked for.
  // Stiff springs between angles amplify the rounding of states, where nothing moves and nothing else is as large.
  // Forces cancel but for their own rounding, as loads and what carries them: OdeSystem::round_off, of the last slope,
  // near the end of the step. Sections with next to no inertia, as tips of beams and rods about their axes, amplify the
  // rounding of all sums: there slopes scatter however little states differ. Takes two slopes; none for some calls,
  // `without_look`, after one that found next to nothing. Valid until the next call.
  const Eigen::VectorXd &error(double t, const double *z, const double *z_dot, double step, Method &method,
                               const Eigen::VectorXd &error, int &without_look);

private:
  OdeSystem &system_;
  Eigen::ArrayXd shift_; // (n) of a state's entries, in roundings
  Eigen::VectorXd shifted_, left_, found_;
};

} // namespace ffrobot
