// Slides along z; in the plane along x. q: way (m).
#pragma once
#include "core/recursion/joint/place.h"
namespace ffrobot::recursion {
struct Prismatic {
  static constexpr JointShape spatial{1, 1, -1, {2}}, planar{1, 1, -1, {0}};
  template <class T> FFROBOT_INLINE static void place(const T *q, const T *v, SpatialPlace<T> &to) {
    to.r[2] = q[0], to.r_dot[2] = v[0];
  }
  template <class T> FFROBOT_INLINE static void place(const T *q, const T *v, PlanarPlace<T> &to) {
    to.r[0] = q[0], to.r_dot[0] = v[0];
  }
};
} // namespace ffrobot::recursion
