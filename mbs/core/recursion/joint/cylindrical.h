// Slides along z and turns about it. q: way (m), angle (rad).
#pragma once
#include "core/recursion/joint/place.h"
namespace ffrobot::recursion {
struct Cylindrical {
  static constexpr JointShape spatial{2, 2, -1, {2, 5}};
  template <class T> FFROBOT_INLINE static void place(const T *q, const T *v, SpatialPlace<T> &to) {
    to.r[2] = q[0], to.r_dot[2] = v[0];
    to.turn_about_z(q[1]);
    to.w[2] = v[1];
  }
};
} // namespace ffrobot::recursion
