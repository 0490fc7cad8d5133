// Forces of the user's on sections, of how these move.
#pragma once

#include "core/recursion/mechanism/workspace.h"

namespace ffrobot {

// Writes force and moment (N, N m) at time t (s) for the motion of a section, all in global axes.
// In the plane: position x, y, angle; rates of these; force x, y and moment.
// In space: position x, y, z, then R of the section's axes row by row; velocity x, y, z and angular velocity; force x,
// y, z and moment about x, y, z.
struct StateFunction {
  using Compiled = void (*)(double t, const double *position, const double *rate, double *force);

  std::function<void(double t, const double *position, const double *rate, double *force)> call;
  bool is_planar = true;
};

namespace recursion {

// On the section on which a wrench of the mechanism acts. Functions of the plane may act in space, too: there the angle
// of a section is that of its x axis, between -pi and pi.
struct PointForce {
  int wrench = 0;
  StateFunction function;
};

// The section on which a wrench acts
template <class Space, class T> Pose<T> wrench_pose(const Placed<Space, T> &at, int wrench);

// Adds them at time t to the wrenches (wrenches, dim). Dual numbers take central differences of the
// functions, whose code is not known, over 1e-6 of `length` (m) and of 1 rad.
template <class Space, class T>
void add_at_points(const Placed<Space, T> &placed, const std::vector<PointForce> &forces, double t, double length,
                   T *wrench);

} // namespace recursion
} // namespace ffrobot
