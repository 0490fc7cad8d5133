// Projection onto C = 0 and C_dot = 0 in the metric of the iteration matrix, for implicit methods.
//
// In the mass metric stiff modes would take up a part of every correction, and give it back as a force K p that no step
// resolves; in this metric they hardly move.
#pragma once

#include "core/integrate/ode.h"

namespace ffrobot {

class ImplicitProjection {
public:
  explicit ImplicitProjection(OdeSystem &system)
      : system_(system), none_(Eigen::VectorXd::Zero(system.n_stiff())), value_(system.constraints()),
        rate_(system.constraints()), correction_(system.n_v()) {}

  // After factorise(real). False where the constraints cannot be met.
  bool operator()(double t, double *y) {
    const auto n = system_.n_v();
    const auto values = [&] { return system_.value_size(y, value_); };
    const auto rates = [&] { return system_.rate_size(y, rate_); };
    const auto move_positions = [&](const Eigen::VectorXd &step) { system_.local().shift(y, -1, step.data()); };
    const auto move_velocities = [&](const Eigen::VectorXd &step) { Eigen::Map<Eigen::VectorXd>(y + n, n) -= step; };
    // Positions first: moving them changes velocities, not the other way round.
    return value_.size() == 0 ||
           (settle(t, y, value_, values, move_positions) && settle(t, y, rate_, rates, move_velocities));
  }

private:
  // Newton steps on the positions or velocities in y until the size() of `residual` vanishes; move(step) takes a step
  // off them.
  template <class Size, class Move>
  bool settle(double t, const double *y, const Eigen::VectorXd &residual, const Size &size, const Move &move) {
    constexpr double tolerance = 1e-12, rounding_floor = 1e-11;
    constexpr int most_iterations = 12;
    double left = 0, previous = 1e300;
    for (int i = 0; i < most_iterations; ++i) {
      system_.constraint_values(t, y, value_.data(), rate_.data());
      left = size();
      const double worth_going_on = left < rounding_floor ? 0.2 : 0.9;
      if (!(left > tolerance) || left > worth_going_on * previous)
        break; // done, NaN, or too slow
      previous = left;
      system_.solve(none_.data(), residual.data(), correction_.data());
      move(correction_);
    }
    return left < rounding_floor;
  }

  OdeSystem &system_;
  Eigen::VectorXd none_, value_, rate_, correction_;
};

} // namespace ffrobot
