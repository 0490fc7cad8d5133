// What a joint does: where it puts the outer of two sections relative to the inner one, and which accelerations it
// leaves free.
//
// Axes of a joint are those of the two triads, equal where its coordinates are zero. It leaves free single components
// of (a, alpha), the acceleration of the outer section in that section's own axes (`Freedoms`); universal and screw
// joints, whose free directions are not axes, first go to coordinates in which they are (`eliminate_joint` in
// joint_elimination.h).
#pragma once

#include "core/recursion/numbers/small.h"

#include <initializer_list>

namespace ffrobot::recursion {

// clang-format off
// THE list of joints: names in scenes, structures in joints.h
#define FFROBOT_JOINTS(X) \
  X(revolute, Revolute) X(prismatic, Prismatic) X(screw, Screw) X(cylindrical, Cylindrical) X(universal, Universal) \
  X(spherical, Spherical) X(planar, PlanarJoint) X(weld, Weld) X(free, Free)
// clang-format on
#define FFROBOT_NAME(name, Joint) name,
enum class JointKind { FFROBOT_JOINTS(FFROBOT_NAME) };

// Components of (a, alpha) that are free, ascending; velocities and forces of the joint are in this order.
struct Freedoms {
  int count = 0;
  int component[6] = {};
  constexpr Freedoms(std::initializer_list<int> list) {
    for (const int i : list)
      component[count++] = i;
  }
};

struct JointShape {
  Freedoms freedoms;
  int quaternion = -1;        // its first entry among the q of the joint; -1 without
  bool in_inner_axes = false; // translations are along axes of the inner section, not of the outer one
  bool free_are_axes = true;  // what is free is an axis of the outer section
  bool is_centred = false;    // origins of the sections stay together

  constexpr int q_count() const { return freedoms.count + (quaternion >= 0); }
};

// Of the outer section: turned by R (cosine, sine of it in the plane), its origin at r from the inner one's; relative
// velocities; all in axes of the outer section but the angle. `w_dot`: rate of w where accelerations of the joint
// vanish.
template <class T> struct SpatialPlace {
  T R[3][3], r[3], r_dot[3], w[3], w_dot[3];

  FFROBOT_INLINE void at_rest() {
    for (int i = 0; i < 3; ++i) {
      r[i] = r_dot[i] = w[i] = w_dot[i] = T(0.);
      for (int j = 0; j < 3; ++j)
        R[i][j] = T(i == j ? 1. : 0.);
    }
  }
  FFROBOT_INLINE void turn_about_z(const T &angle) {
    T s, c;
    sine_and_cosine(angle, s, c);
    R[0][0] = c, R[0][1] = -s, R[1][0] = s, R[1][1] = c;
  }
};

template <class T> struct PlanarPlace {
  T angle, rate, r[2], r_dot[2];

  FFROBOT_INLINE void at_rest() { angle = rate = r[0] = r[1] = r_dot[0] = r_dot[1] = T(0.); }
};

} // namespace ffrobot::recursion
