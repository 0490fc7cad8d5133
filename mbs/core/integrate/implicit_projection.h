// Projection onto C = 0 and C_dot = 0 in the metric of the iteration matrix, for implicit methods.
//
// In the mass metric stiff modes would take up a part of every correction, and give it back as a force K p that no step
// resolves; in this metric they hardly move.
#pragma once

#include "core/integrate/ode.h"

namespace ffrobot {

class ImplicitProjection {
public:
  explicit ImplicitProjection(ImplicitSystem &system);

  // After factorise(real). False where the constraints cannot be met.
  bool operator()(double t, double *y);

private:
  using VectorMap = Eigen::Map<Eigen::VectorXd>;

  // Newton steps on the positions or velocities in y until the size() of `residual` vanishes; move(step) takes a step
  // off them.
  template <class Size, class Move>
  bool settle(double t, const double *y, const Eigen::VectorXd &residual, const Size &size, const Move &move);

  ImplicitSystem &system_;
  Eigen::VectorXd none_, value_, rate_, correction_;
};

} // namespace ffrobot
