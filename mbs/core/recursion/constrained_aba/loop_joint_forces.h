// Sections on which wrenches act, and what acts along joints at which loops are cut, for one space and scalar:
// included by the .cpp of each.
#pragma once

#include "core/recursion/constrained_aba/constraints.h"
#include "core/recursion/constrained_aba/loop_joint.h"
#include "core/recursion/constrained_aba/point_force.h"

namespace ffrobot::recursion {

template <class Space, class T> Pose<T> wrench_pose(const Placed<Space, T> &at, int wrench) {
  Pose<T> found;
  attachment_pose(at.w.m.wrenches[wrench], at.w, found);
  return found;
}

// The axis (global axes) and the sections of a coordinate
template <class T> struct CutPose {
  Pose<T> a, b;
  T axis[3], d[3]; // of a; from a to b
};

template <class Space, class T> void cut_pose(const Placed<Space, T> &placed, const CutJoint &cut, CutPose<T> &to) {
  to.a = wrench_pose(placed, cut.a), to.b = wrench_pose(placed, cut.b);
  const T axis[3] = {T(cut.axis[0]), T(cut.axis[1]), T(cut.axis[2])};
  turn(to.a.R, axis, to.axis);
  for (int i = 0; i < 3; ++i)
    to.d[i] = to.b.r[i] - to.a.r[i];
}

// n . (Omega_b - Omega_a), or d/dt n . d with n turning with a
template <class Space, class T>
void cut_rates(const Placed<Space, T> &placed, const std::vector<CutJoint> &cuts, T *rate) {
  CutPose<T> at;
  for (std::size_t k = 0; k < cuts.size(); ++k) {
    cut_pose(placed, cuts[k], at);
    T relative[3], swept[3];
    cross(at.a.omega, at.d, swept);
    for (int i = 0; i < 3; ++i)
      relative[i] = cuts[k].turns ? at.b.omega[i] - at.a.omega[i] : at.b.v[i] - at.a.v[i] - swept[i];
    rate[k] = dot(at.axis, relative);
  }
}

// A force on b acts where b is: at a it has a moment, too.
template <class Space, class T>
void add_along_cuts(const Placed<Space, T> &placed, const std::vector<CutJoint> &cuts, const T *size, T *wrench) {
  constexpr int d = Space::dim;
  CutPose<T> at;
  const auto add = [&](int number, double sign, const T &amount, const T *force, const T *moment) {
    T *to = wrench + d * number;
    for (int i = 0; force && i < Space::linear; ++i)
      to[i] += sign * amount * force[i];
    for (int i = Space::linear; i < d; ++i)
      to[i] += sign * amount * moment[i - d + 3];
  };
  for (std::size_t k = 0; k < cuts.size(); ++k) {
    const CutJoint &cut = cuts[k];
    cut_pose(placed, cut, at);
    if (cut.turns) {
      add(cut.b, 1, size[k], nullptr, at.axis), add(cut.a, -1, size[k], nullptr, at.axis);
      continue;
    }
    const T none[3] = {T(0.), T(0.), T(0.)};
    T moment[3];
    cross(at.d, at.axis, moment);
    add(cut.b, 1, size[k], at.axis, none), add(cut.a, -1, size[k], at.axis, moment);
  }
}

} // namespace ffrobot::recursion
