// Sections on which wrenches act, and what acts along joints at which loops are cut, for one space and scalar:
// included by the .cpp of each.
#pragma once

#include "core/recursion/cut.h"
#include "core/recursion/point_force.h"
#include "core/recursion/rows.h"

namespace ffrobot::recursion {

template <class Space, class T>
Pose<T> wrench_pose(const Mechanism<Space> &m, int wrench, const Workspace<Space, T> &w) {
  Pose<T> at;
  attachment_pose(m, m.wrenches[static_cast<std::size_t>(wrench)], w, at);
  return at;
}

// The axis (global axes) and the sections of a coordinate, after locate().
template <class T> struct CutPose {
  Pose<T> a, b;
  T axis[3], d[3]; // of a; from a to b
};

template <class Space, class T>
void cut_pose(const Mechanism<Space> &m, const CutJoint &cut, const Workspace<Space, T> &w, CutPose<T> &to) {
  to.a = wrench_pose(m, cut.a, w), to.b = wrench_pose(m, cut.b, w);
  const T axis[3] = {T(cut.axis[0]), T(cut.axis[1]), T(cut.axis[2])};
  turn(to.a.R, axis, to.axis);
  for (int i = 0; i < 3; ++i)
    to.d[i] = to.b.r[i] - to.a.r[i];
}

// n . (Omega_b - Omega_a), or d/dt n . d with n turning with a
template <class Space, class T>
void cut_rates(const Mechanism<Space> &m, const std::vector<CutJoint> &cuts, const Workspace<Space, T> &w, T *rate) {
  CutPose<T> at;
  for (std::size_t k = 0; k < cuts.size(); ++k) {
    cut_pose(m, cuts[k], w, at);
    T relative[3], swept[3];
    cross(at.a.omega, at.d, swept);
    for (int i = 0; i < 3; ++i)
      relative[i] = cuts[k].turns ? at.b.omega[i] - at.a.omega[i] : at.b.v[i] - at.a.v[i] - swept[i];
    rate[k] = dot(at.axis, relative);
  }
}

// A force on b acts where b is: at a it has a moment, too.
template <class Space, class T>
void add_along_cuts(const Mechanism<Space> &m, const std::vector<CutJoint> &cuts, const T *size,
                    const Workspace<Space, T> &w, T *wrench) {
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
    cut_pose(m, cut, w, at);
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
