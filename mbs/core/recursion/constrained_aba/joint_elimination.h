// Inward through a joint: its freedoms leave the inertia of what it carries.
#pragma once

#include "core/recursion/constrained_aba/delassus.h"
#include "core/recursion/kinematics/spatial.h"

namespace ffrobot::recursion {

// Forces f and accelerations A of a section, from its own axes to those in which the freedoms of its joint are single
// components (sign 1), and back (-1): the cross of a universal joint, about whose y x and z turn; of a screw, a_z is
// less what the turn does, a_z - lead alpha_z
template <int sign, class Space, class T, class X>
FFROBOT_INLINE bool turn_to_cross(const Node<Space> &node, const Hinge<Space, T> &hinge, X *x) {
  if (node.joint != JointKind::universal)
    return false;
  const T c = hinge.cross_cosine, s = double(sign) * hinge.cross_sine;
  for (const int k : {0, 3}) {
    const X u = c * x[k] + s * x[k + 2], v = c * x[k + 2] - s * x[k];
    x[k] = u, x[k + 2] = v;
  }
  return true;
}
template <int sign, class Space, class T, class X>
FFROBOT_INLINE void forces_by_freedoms(const Node<Space> &node, const Hinge<Space, T> &hinge, X *f) {
  if constexpr (Space::dim == 6)
    if (!turn_to_cross<sign>(node, hinge, f) && node.joint == JointKind::screw)
      f[5] += sign * node.lead * f[2];
}
template <int sign, class Space, class T>
FFROBOT_INLINE void acceleration_by_freedoms(const Node<Space> &node, const Hinge<Space, T> &hinge, T *A) {
  if constexpr (Space::dim == 6)
    if (!turn_to_cross<sign>(node, hinge, A) && node.joint == JointKind::screw)
      A[2] -= sign * node.lead * A[5];
}

// Symmetric matrix of rows, from both sides
template <class F, int d, class T> FFROBOT_INLINE void both_sides(const F &change, Pack<T, d> *M) {
  change(M);
  for (int i = 0; i < d; ++i) {
    T x[d];
    for (int j = 0; j < d; ++j)
      x[j] = M[i][j];
    change(x);
    for (int j = 0; j < d; ++j)
      M[i].set(j, x[j]);
  }
}

// Whether a constraint has the coordinate of a freedom of the node's joint
template <class Space> FFROBOT_INLINE bool is_along(const Constraint &row, const Node<Space> &node, int freedom) {
  return row.node == node.index && row.freedom == freedom;
}

// What unit multipliers do along a freedom of the node's joint, by columns: constraints that have this coordinate.
template <class T, int W, class Space>
FFROBOT_INLINE Pack<T, W> multiplier_forces(const Node<Space> &node, int freedom, const Workspace<Space, T> &w) {
  auto forces = Pack<T, W>::zero();
  if (node.has_constraints)
    for (std::size_t r = 0; r < w.active.size(); ++r)
      if (is_along(w.m.constraints[w.active[r]], node, freedom))
        forces.set(static_cast<int>(r) + 1, T(-w.m.constraints[w.active[r]].share));
  return forces;
}

// What the multipliers y do along it
template <class T, int W, class Space>
FFROBOT_INLINE T multiplier_force(const Node<Space> &node, int freedom, const Workspace<Space, T> &w,
                                  const Pack<T, W> &y) {
  if constexpr (W == most_columns)
    if (!w.blocks.empty()) { // y is 1 then, and the answers of all columns are added up
      T sum(0.);
      for (std::size_t r = 0; r < w.active.size(); ++r)
        if (is_along(w.m.constraints[w.active[r]], node, freedom))
          sum -= w.m.constraints[w.active[r]].share * w.y[r + 1];
      return sum;
    }
  return (multiplier_forces<T, W>(node, freedom, w) * y).sum();
}

// One freedom along component f, `known` while compiling, or -1: row and column of M leave, with what the rotor on the
// inner section adds.
template <int known, class Space, class T, int W>
FFROBOT_INLINE void eliminate_freedom(const Node<Space> &node, int freedom, const T *force, Hinge<Space, T> &hinge,
                                      Workspace<Space, T> &w, Pack<T, Space::dim> *M, Pack<T, W> *H,
                                      Delassus<T, W> &S) {
  constexpr int d = Space::dim, stride = stride_of(W);
  using Cols = Pack<T, W>;
  const int f = known >= 0 ? known : node.shape.freedoms.component[freedom];
  Cols applied = multiplier_forces<T, W>(node, freedom, w); // along the freedom
  if (force)
    applied.set(0, force[freedom]);
  const Cols before = H[f], su = before - applied;
  Pack<T, d> U = M[f];
  const double J = node.rotor_inertia, N = node.gear_ratio, c = node.rotor_turns;
  const T M_ff = U[f], D_inverse = T(1.) / (J > 0 ? M_ff + N * N * J : M_ff);
  const Cols sd = D_inverse * su;
  sd.write(w.stored.data() + node.joint_slot(freedom) * stride);
  if (W > 1)
    add_dyad(S, sd, su);
  const Pack<T, d> U_by_D = D_inverse * U;
  for (int j = 0; j < d; ++j)
    if (known != j) { // row f is written below
      const T U_j = U[j];
      M[j] -= U_j * U_by_D;
      M[j].set(f, T(0.));
      H[j] -= U_j * sd;
    }
  M[f] = Pack<T, d>::zero();
  H[f] = applied;
  if (J > 0) {
    M[f] = (N * (N - c) * J) * U_by_D;
    for (int j = 0; j < d; ++j)
      M[j].set(f, M[f][j]);
    M[f].set(f, M_ff * ((N - c) * (N - c) * J) * D_inverse);
    U.set(f, M_ff + c * N * J);
    H[f] = before - U[f] * sd;
  }
  hinge.U[freedom] = U, hinge.D_inverse[freedom] = D_inverse;
}

template <class Space, class T, int W>
inline void eliminate_joint(const Node<Space> &node, const T *q, const T *force, Workspace<Space, T> &w,
                            Pack<T, Space::dim> *M, Pack<T, W> *H, Delassus<T, W> &S) {
  constexpr int d = Space::dim;
  Hinge<Space, T> &hinge = w.hinges[node.index];
  T applied[6], outer[6];
  if (force) {
    for (int i = 0; i < 6; ++i)
      applied[i] = T(0.);
    for (int k = 0; k < node.shape.freedoms.count; ++k)
      applied[k] = force[k];
    if (node.shape.in_inner_axes) { // freedoms ascending: translations first
      T x[6] = {applied[0], applied[1], T(0.), T(0.), T(0.), T(0.)};
      if (Space::dim == 6 && node.joint == JointKind::free)
        x[2] = applied[2];
      change_section<false>(node, q, x, outer);
      for (int k = 0; k < (node.joint == JointKind::free ? Space::linear : 2); ++k)
        applied[k] = outer[k];
    }
  }
  const auto change = [&](const auto &of_forces) { // of M from both sides, of H
    if (!node.shape.free_are_axes)
      both_sides<decltype(of_forces), d, T>(of_forces, M), of_forces(H);
  };
  change([&](auto *x) { forces_by_freedoms<1>(node, hinge, x); });
  for (int k = node.shape.freedoms.count - 1; k >= 0; --k)
    if (std::is_same_v<T, double> && node.shape.freedoms.component[k] == Space::axis)
      eliminate_freedom<Space::axis>(node, k, force ? applied : nullptr, hinge, w, M, H, S);
    else
      eliminate_freedom<-1>(node, k, force ? applied : nullptr, hinge, w, M, H, S);
  if (M != hinge.Lambda)
    for (int i = 0; i < d; ++i)
      hinge.Lambda[i] = M[i]; // in axes of the cross, or without the last row: `factors` knows
  if (node.is_single_grounded)
    for (int i = 0; i < d; ++i)
      H[i].write(w.stored.data() + (node.ground_slot() + i) * stride_of(W));
  change([&](auto *x) { forces_by_freedoms<-1>(node, hinge, x); });
}

} // namespace ffrobot::recursion
