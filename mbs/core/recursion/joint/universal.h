// Turns about x of the inner section, then about y of the outer one. q: both angles (rad).
//
// w = (cos b, 0, sin b) a_dot + (0, 1, 0) b_dot. In axes turned back by b, those of the cross, free are x and y.
#pragma once
#include "core/recursion/joint/place.h"
namespace ffrobot::recursion {
struct Universal {
  static constexpr JointShape spatial{2, 2, -1, {3, 4}, false, false};
  template <class T> FFROBOT_INLINE static void place(const T *q, const T *v, SpatialPlace<T> &to) {
    T sa, ca, sb, cb;
    sine_and_cosine(q[0], sa, ca);
    sine_and_cosine(q[1], sb, cb);
    const T zero(0.), R[3][3] = {{cb, zero, sb}, {sa * sb, ca, -(sa * cb)}, {-(ca * sb), sa, ca * cb}};
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        to.R[i][j] = R[i][j];
    to.w[0] = cb * v[0], to.w[1] = v[1], to.w[2] = sb * v[0];
    to.w_dot[0] = -(sb * v[0] * v[1]), to.w_dot[2] = cb * v[0] * v[1];
  }
};
} // namespace ffrobot::recursion
