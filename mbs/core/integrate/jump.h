// Jumps of slopes in time: a load that is switched on or off, an acceleration of a path that starts at once.
#pragma once

#include "core/integrate/ode.h"

#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

namespace ffrobot {

struct Jump {
  double before, after; // s, as close together as rounding of the times tells apart
};

// Where slopes at the state z jump between `start` and `end`, which are short compared with what else changes them;
// nothing where they do not. Bisection: some 50 slopes.
inline std::optional<Jump> find_jump(OdeSystem &system, const double *z, double start, double end) {
  constexpr double part_of_change = 0.5; // that is there between neighbours still: what is only steep has none of it
  constexpr double least = 1e-9;         // of the largest accelerations so far: more than rounding
  constexpr double at_once = 1e-9;       // of the interval: what accelerations do to velocities meanwhile is nothing
  VectorXd left(system.size()), middle(left), right(left), change(left);
  system.slope(start, z, left.data());
  system.slope(end, z, right.data());
  const double rate = 1 / (at_once * (end - start));
  const auto size = [&](const VectorXd &from, const VectorXd &to) {
    change = (to - from) / rate;
    return system.change_size(z, change.data(), rate);
  };
  const double whole = size(left, right);
  if (!(whole > least) || !std::isfinite(whole))
    return std::nullopt;
  // numbers next to 0 are much closer together than times can be told apart
  const double resolution = 0.5 * std::numeric_limits<double>::epsilon() * std::max(std::abs(start), std::abs(end));
  double t = std::midpoint(start, end);
  for (; start < t && t < end && end - start > resolution; t = std::midpoint(start, end)) {
    system.slope(t, z, middle.data());
    if (size(left, middle) > size(middle, right)) {
      end = t;
      right.swap(middle);
    } else {
      start = t;
      left.swap(middle);
    }
  }
  if (!(size(left, right) >= part_of_change * whole))
    return std::nullopt;
  return Jump{start, end};
}

} // namespace ffrobot
