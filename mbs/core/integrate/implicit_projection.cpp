#include "core/integrate/implicit_projection.h"

namespace ffrobot {

using Eigen::VectorXd;
using VectorMap = Eigen::Map<VectorXd>;

ImplicitProjection::ImplicitProjection(ImplicitSystem &system)
    : system_(system), none_(VectorXd::Zero(system.size() / 2)), value_(system.constraints()),
      rate_(system.constraints()), correction_(system.size() / 2) {}

bool ImplicitProjection::operator()(double t, double *y) {
  const auto n = none_.size();
  // Positions first: moving them changes velocities, not the other way round.
  return value_.size() == 0 || (settle(t, y, y, value_) && settle(t, y, y + n, rate_));
}

// Newton steps on x, the positions or velocities in y, until `residual` vanishes.
bool ImplicitProjection::settle(double t, const double *y, double *x, const VectorXd &residual) {
  constexpr double tolerance = 1e-12, rounding_floor = 1e-11;
  constexpr int most_iterations = 12;
  VectorMap x_(x, none_.size());
  double left = 0, previous = 1e300;
  for (int i = 0; i < most_iterations; ++i) {
    system_.constraint_values(t, y, value_.data(), rate_.data());
    left = residual.lpNorm<Eigen::Infinity>() / (1 + x_.lpNorm<Eigen::Infinity>());
    const double worth_going_on = left < rounding_floor ? 0.2 : 0.9;
    if (!(left > tolerance) || left > worth_going_on * previous)
      break; // done, NaN, or too slow
    previous = left;
    system_.solve(none_.data(), residual.data(), correction_.data());
    x_ -= correction_;
  }
  return left < rounding_floor;
}

} // namespace ffrobot
