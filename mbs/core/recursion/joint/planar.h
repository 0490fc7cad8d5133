// Slides along x and y of the inner section and turns about their normal. q: two ways (m) and an angle (rad).
#pragma once
#include "core/recursion/joint/place.h"
namespace ffrobot::recursion {
struct PlanarJoint {
  static constexpr JointShape spatial{3, 3, -1, {0, 1, 5}, true};
  template <class T> FFROBOT_INLINE static void place(const T *q, const T *v, SpatialPlace<T> &to) {
    to.turn_about_z(q[2]);
    const T r[3] = {q[0], q[1], T(0.)}, r_dot[3] = {v[0], v[1], T(0.)};
    turn_back(to.R, r, to.r);
    turn_back(to.R, r_dot, to.r_dot);
    to.w[2] = v[2];
  }
};
} // namespace ffrobot::recursion
