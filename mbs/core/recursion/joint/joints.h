// The list of joint types: nothing else asks which there are.
#pragma once

#include "core/recursion/joint/cylindrical.h"
#include "core/recursion/joint/free.h"
#include "core/recursion/joint/planar.h"
#include "core/recursion/joint/prismatic.h"
#include "core/recursion/joint/revolute.h"
#include "core/recursion/joint/screw.h"
#include "core/recursion/joint/spherical.h"
#include "core/recursion/joint/universal.h"
#include "core/recursion/joint/weld.h"

#include <stdexcept>

namespace ffrobot::recursion {

constexpr JointShape spatial_shape(JointKind kind) {
  switch (kind) {
  case JointKind::revolute:
    return Revolute::spatial;
  case JointKind::prismatic:
    return Prismatic::spatial;
  case JointKind::screw:
    return Screw::spatial;
  case JointKind::cylindrical:
    return Cylindrical::spatial;
  case JointKind::universal:
    return Universal::spatial;
  case JointKind::spherical:
    return Spherical::spatial;
  case JointKind::planar:
    return PlanarJoint::spatial;
  case JointKind::weld:
    return Weld::spatial;
  default:
    return Free::spatial;
  }
}

constexpr JointShape planar_shape(JointKind kind) {
  switch (kind) {
  case JointKind::revolute:
    return Revolute::planar;
  case JointKind::prismatic:
    return Prismatic::planar;
  case JointKind::weld:
    return Weld::planar;
  case JointKind::free:
    return Free::planar;
  default:
    throw std::invalid_argument("joint: expected revolute, prismatic, weld or free in the plane");
  }
}

template <class T> FFROBOT_INLINE void place(JointKind kind, double lead, const T *q, const T *v, SpatialPlace<T> &to) {
  to.at_rest();
  switch (kind) {
  case JointKind::revolute:
    return Revolute::place(q, v, to);
  case JointKind::prismatic:
    return Prismatic::place(q, v, to);
  case JointKind::screw:
    return Screw::place(q, v, lead, to);
  case JointKind::cylindrical:
    return Cylindrical::place(q, v, to);
  case JointKind::universal:
    return Universal::place(q, v, to);
  case JointKind::spherical:
    return Spherical::place(q, v, to);
  case JointKind::planar:
    return PlanarJoint::place(q, v, to);
  case JointKind::weld:
    return;
  case JointKind::free:
    return Free::place(q, v, to);
  }
}

template <class T> FFROBOT_INLINE void place(JointKind kind, double, const T *q, const T *v, PlanarPlace<T> &to) {
  to.angle = to.rate = to.r[0] = to.r[1] = to.r_dot[0] = to.r_dot[1] = T(0.);
  if (kind == JointKind::revolute)
    Revolute::place(q, v, to);
  else if (kind == JointKind::prismatic)
    Prismatic::place(q, v, to);
  else if (kind == JointKind::free)
    Free::place(q, v, to);
}

} // namespace ffrobot::recursion
