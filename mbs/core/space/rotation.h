// Rotations as unit quaternions and as rotation vectors in body axes (rad).
#pragma once

#include "core/eigen.h"

#include <Eigen/Geometry>

#include <cmath>

namespace ffrobot {

// exp(x): the rotation by |x| about x
inline Eigen::Quaterniond rotation_of(const Vector3d &x) {
  const double angle = x.norm();
  const double half_sinc = angle < 1e-4 ? 0.5 - angle * angle / 48 : std::sin(0.5 * angle) / angle;
  const Vector3d axis = half_sinc * x;
  return {std::cos(0.5 * angle), axis.x(), axis.y(), axis.z()};
}

// log(e): the shortest rotation vector, |x| <= pi
inline Vector3d rotation_vector(const Eigen::Quaterniond &e) {
  const double sine = e.vec().norm();
  if (sine < 1e-8)
    return 2 / e.w() * e.vec();
  const double angle = 2 * std::atan2(e.w() < 0 ? -sine : sine, std::abs(e.w()));
  return angle / sine * e.vec();
}

// x_dot of the rotation vector x of a body that turns with the angular velocity omega, in body axes: the inverse of the
// right Jacobian of exp. H. Munthe-Kaas, BIT 38 (1998); A. Iserles et al., Acta Numerica 9 (2000), sec. B.
inline Vector3d rotation_vector_rate(const Vector3d &x, const Vector3d &omega) {
  const double angle = x.norm();
  const double factor =
      angle < 1e-2 ? 1. / 12 + angle * angle / 720 : (1 - 0.5 * angle / std::tan(0.5 * angle)) / (angle * angle);
  return omega + 0.5 * x.cross(omega) + factor * x.cross(x.cross(omega));
}

} // namespace ffrobot
