// Holds nothing. q: position in axes of the inner section (m), unit quaternion (w, x, y, z) from the outer section's
// axes to the inner one's; v: velocity in axes of the inner section, angular velocity in axes of the outer one. In the
// plane position (x, y) and angle.
#pragma once
#include "core/recursion/joint/spherical.h"
namespace ffrobot::recursion {
struct Free {
  static constexpr JointShape spatial{7, 6, 3, {0, 1, 2, 3, 4, 5}, true}, planar{3, 3, -1, {0, 1, 2}, true};
  template <class T> FFROBOT_INLINE static void place(const T *q, const T *v, SpatialPlace<T> &to) {
    rotation_of(q + 3, to.R);
    turn_back(to.R, q, to.r);
    turn_back(to.R, v, to.r_dot);
    for (int i = 0; i < 3; ++i)
      to.w[i] = v[3 + i];
  }
  template <class T> FFROBOT_INLINE static void place(const T *q, const T *v, PlanarPlace<T> &to) {
    T s, c;
    sine_and_cosine(q[2], s, c);
    to.angle = q[2], to.rate = v[2];
    to.r[0] = c * q[0] + s * q[1], to.r[1] = c * q[1] - s * q[0];
    to.r_dot[0] = c * v[0] + s * v[1], to.r_dot[1] = c * v[1] - s * v[0];
  }
};
} // namespace ffrobot::recursion
