// Jumps of slopes in time: a load that is switched on or off, an acceleration of a path that starts at once.
#pragma once

#include "core/integrate/ode.h"

#include <optional>

namespace ffrobot {

struct Jump {
  double before, after; // s, as close together as rounding of the times tells apart
};

// Where slopes at the state z jump between `start` and `end`, which are short compared with what else changes them;
// nothing where they do not. Bisection: some 50 slopes.
std::optional<Jump> find_jump(OdeSystem &system, const double *z, double start, double end);

} // namespace ffrobot
