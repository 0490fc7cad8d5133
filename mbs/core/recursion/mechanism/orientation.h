// Orientations that sections follow in time: a triad A(t) with its angular velocity and acceleration, exact.
#pragma once

#include "core/time_function/time_function.h"

#include "core/eigen.h"

#include <array>

namespace ffrobot::recursion {

// A triad that turns, global axes: columns of A, rad/s, rad/s^2.
struct Turning {
  Matrix3d A = Matrix3d::Identity();
  Vector3d omega = Vector3d::Zero(), alpha = Vector3d::Zero();
};

enum class OrientationKind {
  rotation_vector, // A = exp(psi~) reference
  rpy,             // A = R_z(yaw) R_y(pitch) R_x(roll) reference: about the ground's x, y, z in this order
  direction,       // z of A along a vector of any length, by the smallest turn; omega without spin about it
};

struct OrientationLaw {
  OrientationKind kind = OrientationKind::rotation_vector;
  std::array<TimeFunction, 3> functions{Constant(0), Constant(0), Constant(0)};
  Matrix3d reference = Matrix3d::Identity();

  Turning operator()(double t) const;
};

} // namespace ffrobot::recursion
