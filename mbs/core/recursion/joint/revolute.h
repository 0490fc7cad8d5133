// Turns about z. q: angle (rad).
#pragma once
#include "core/recursion/joint/place.h"
namespace ffrobot::recursion {
struct Revolute {
  static constexpr JointShape spatial{1, 1, -1, {5}, false, true, true}, planar{1, 1, -1, {2}, false, true, true};
  template <class T> FFROBOT_INLINE static void place(const T *q, const T *v, SpatialPlace<T> &to) {
    to.turn_about_z(q[0]);
    to.w[2] = v[0];
  }
  template <class T> FFROBOT_INLINE static void place(const T *q, const T *v, PlanarPlace<T> &to) {
    to.angle = q[0], to.rate = v[0];
  }
};
} // namespace ffrobot::recursion
