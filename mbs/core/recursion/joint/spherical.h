// Turns freely. q: unit quaternion (w, x, y, z) from the outer section's axes to the inner one's; v: relative angular
// velocity in axes of the outer section (rad/s).
#pragma once
#include "core/recursion/joint/place.h"
namespace ffrobot::recursion {
// Of a quaternion whose norm may be a little off
template <class T> FFROBOT_INLINE void rotation_of(const T *e, T (&R)[3][3]) {
  const T scale = T(2.) / (e[0] * e[0] + e[1] * e[1] + e[2] * e[2] + e[3] * e[3]);
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    R[i][i] = T(1.) - scale * (e[1 + j] * e[1 + j] + e[1 + k] * e[1 + k]);
    R[i][j] = scale * (e[1 + i] * e[1 + j] - e[0] * e[1 + k]);
    R[i][k] = scale * (e[1 + i] * e[1 + k] + e[0] * e[1 + j]);
  }
}
struct Spherical {
  static constexpr JointShape spatial{4, 3, 0, {3, 4, 5}};
  template <class T> FFROBOT_INLINE static void place(const T *q, const T *v, SpatialPlace<T> &to) {
    rotation_of(q, to.R);
    for (int i = 0; i < 3; ++i)
      to.w[i] = v[i];
  }
};
} // namespace ffrobot::recursion
