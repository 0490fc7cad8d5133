#include "core/integrate/implicit_projection.h"

namespace ffrobot {

using Eigen::VectorXd;
ImplicitProjection::ImplicitProjection(ImplicitSystem &system)
    : system_(system), none_(VectorXd::Zero(system.n_stiff())), value_(system.constraints()),
      rate_(system.constraints()), correction_(system.n_v()) {}

bool ImplicitProjection::operator()(double t, double *y) {
  const auto n = system_.n_v();
  const auto values = [&] { return system_.value_size(y, value_); };
  const auto rates = [&] { return system_.rate_size(y, rate_); };
  const auto move_positions = [&](const VectorXd &step) { system_.local().shift(y, -1, step.data()); };
  const auto move_velocities = [&](const VectorXd &step) { VectorMap(y + n, n) -= step; };
  // Positions first: moving them changes velocities, not the other way round.
  return value_.size() == 0 ||
         (settle(t, y, value_, values, move_positions) && settle(t, y, rate_, rates, move_velocities));
}

template <class Size, class Move>
bool ImplicitProjection::settle(double t, const double *y, const VectorXd &residual, const Size &size,
                                const Move &move) {
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

} // namespace ffrobot
