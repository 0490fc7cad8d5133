// Turns about z and slides along it by `lead` (m/rad) times the angle. q: angle (rad).
#pragma once
#include "core/recursion/joint/place.h"
namespace ffrobot::recursion {
struct Screw {
  static constexpr JointShape spatial{1, 1, -1, {5}, false, false};
  template <class T> FFROBOT_INLINE static void place(const T *q, const T *v, double lead, SpatialPlace<T> &to) {
    to.turn_about_z(q[0]);
    to.w[2] = v[0];
    to.r[2] = lead * q[0], to.r_dot[2] = lead * v[0];
  }
};
} // namespace ffrobot::recursion
