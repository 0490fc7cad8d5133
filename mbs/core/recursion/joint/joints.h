// The types of joints, and the lists of them: nothing else asks which there are.
#pragma once

#include "core/recursion/joint/place.h"

#include <stdexcept>
#include <type_traits>

namespace ffrobot::recursion {

// Turns about z. q: angle (rad).
struct Revolute {
  static constexpr JointShape spatial{.freedoms = {5}, .is_centred = true}, planar{.freedoms = {2}, .is_centred = true};
  template <class T> FFROBOT_INLINE static void place(const T *q, const T *v, SpatialPlace<T> &to) {
    to.turn_about_z(q[0]);
    to.w[2] = v[0];
  }
  template <class T> FFROBOT_INLINE static void place(const T *q, const T *v, PlanarPlace<T> &to) {
    to.angle = q[0], to.rate = v[0];
  }
};

// Slides along z; in the plane along x. q: way (m).
struct Prismatic {
  static constexpr JointShape spatial{.freedoms = {2}}, planar{.freedoms = {0}};
  template <class T> FFROBOT_INLINE static void place(const T *q, const T *v, SpatialPlace<T> &to) {
    to.r[2] = q[0], to.r_dot[2] = v[0];
  }
  template <class T> FFROBOT_INLINE static void place(const T *q, const T *v, PlanarPlace<T> &to) {
    to.r[0] = q[0], to.r_dot[0] = v[0];
  }
};

// Turns about z and slides along it by `lead` (m/rad) times the angle. q: angle (rad).
struct Screw {
  static constexpr JointShape spatial{.freedoms = {5}, .free_are_axes = false};
  template <class T> FFROBOT_INLINE static void place(const T *q, const T *v, double lead, SpatialPlace<T> &to) {
    to.turn_about_z(q[0]);
    to.w[2] = v[0];
    to.r[2] = lead * q[0], to.r_dot[2] = lead * v[0];
  }
};

// Slides along z and turns about it. q: way (m), angle (rad).
struct Cylindrical {
  static constexpr JointShape spatial{.freedoms = {2, 5}};
  template <class T> FFROBOT_INLINE static void place(const T *q, const T *v, SpatialPlace<T> &to) {
    to.r[2] = q[0], to.r_dot[2] = v[0];
    to.turn_about_z(q[1]);
    to.w[2] = v[1];
  }
};

// Turns about x of the inner section, then about y of the outer one. q: both angles (rad).
//
// w = (cos b, 0, sin b) a_dot + (0, 1, 0) b_dot. In axes turned back by b, those of the cross, free are x and y.
struct Universal {
  static constexpr JointShape spatial{.freedoms = {3, 4}, .free_are_axes = false};
  template <class T> FFROBOT_INLINE static void place(const T *q, const T *v, SpatialPlace<T> &to) {
    T sa, ca, sb, cb;
    sine_and_cosine(q[0], sa, ca);
    sine_and_cosine(q[1], sb, cb);
    const T zero(0.), R[3][3] = {{cb, zero, sb}, {sa * sb, ca, -(sa * cb)}, {-(ca * sb), sa, ca * cb}};
    assign(R, to.R);
    to.w[0] = cb * v[0], to.w[1] = v[1], to.w[2] = sb * v[0];
    to.w_dot[0] = -(sb * v[0] * v[1]), to.w_dot[2] = cb * v[0] * v[1];
  }
};

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

// Turns freely. q: unit quaternion (w, x, y, z) from the outer section's axes to the inner one's; v: relative angular
// velocity in axes of the outer section (rad/s).
struct Spherical {
  static constexpr JointShape spatial{.freedoms = {3, 4, 5}, .quaternion = 0};
  template <class T> FFROBOT_INLINE static void place(const T *q, const T *v, SpatialPlace<T> &to) {
    rotation_of(q, to.R);
    for (int i = 0; i < 3; ++i)
      to.w[i] = v[i];
  }
};

// Slides along x and y of the inner section and turns about their normal. q: two ways (m) and an angle (rad).
struct PlanarJoint {
  static constexpr JointShape spatial{.freedoms = {0, 1, 5}, .in_inner_axes = true},
      planar{.freedoms = {0, 1, 2}, .in_inner_axes = true};
  template <class T> FFROBOT_INLINE static void place(const T *q, const T *v, SpatialPlace<T> &to) {
    to.turn_about_z(q[2]);
    const T r[3] = {q[0], q[1], T(0.)}, r_dot[3] = {v[0], v[1], T(0.)};
    turn_back(to.R, r, to.r);
    turn_back(to.R, r_dot, to.r_dot);
    to.w[2] = v[2];
  }
  template <class T> FFROBOT_INLINE static void place(const T *q, const T *v, PlanarPlace<T> &to) {
    T s, c;
    sine_and_cosine(q[2], s, c);
    to.angle = q[2], to.rate = v[2];
    to.r[0] = c * q[0] + s * q[1], to.r[1] = c * q[1] - s * q[0];
    to.r_dot[0] = c * v[0] + s * v[1], to.r_dot[1] = c * v[1] - s * v[0];
  }
};

// Holds everything.
struct Weld {
  static constexpr JointShape spatial{}, planar{};
  template <class T, class Place> FFROBOT_INLINE static void place(const T *, const T *, Place &) {}
};

// Holds nothing. q: position in axes of the inner section (m), unit quaternion (w, x, y, z) from the outer section's
// axes to the inner one's; v: velocity in axes of the inner section, angular velocity in axes of the outer one.
struct Free {
  static constexpr JointShape spatial{.freedoms = {0, 1, 2, 3, 4, 5}, .quaternion = 3, .in_inner_axes = true};
  template <class T> FFROBOT_INLINE static void place(const T *q, const T *v, SpatialPlace<T> &to) {
    rotation_of(q + 3, to.R);
    turn_back(to.R, q, to.r);
    turn_back(to.R, v, to.r_dot);
    for (int i = 0; i < 3; ++i)
      to.w[i] = v[3 + i];
  }
};

// clang-format off
#define FFROBOT_CASE(name, Joint) case JointKind::name: return f(Joint());
// clang-format on

// f of the structure of a joint
template <class F> FFROBOT_INLINE constexpr auto of_kind(JointKind kind, const F &f) {
  switch (kind) { FFROBOT_JOINTS(FFROBOT_CASE) }
  __builtin_unreachable();
}

constexpr JointShape spatial_shape(JointKind kind) {
  return of_kind(kind, [](auto joint) { return joint.spatial; });
}

constexpr JointShape planar_shape(JointKind kind) {
  return of_kind(kind, [](auto joint) -> JointShape {
    if constexpr (requires { joint.planar; })
      return joint.planar;
    throw std::invalid_argument("joint: expected one that exists in the plane");
  });
}

template <class T, template <class> class Place>
FFROBOT_INLINE void place(JointKind kind, double lead, const T *q, const T *v, Place<T> &to) {
  to.at_rest();
  of_kind(kind, [&](auto joint) __attribute__((always_inline)) {
    constexpr bool in_space = std::is_same_v<Place<T>, SpatialPlace<T>>;
    if constexpr (requires { joint.place(q, v, lead, to); })
      joint.place(q, v, lead, to);
    else if constexpr (in_space || requires { joint.planar; })
      joint.place(q, v, to);
  });
}

} // namespace ffrobot::recursion
