// Constraint equations: their values and rates, and what they and wrenches do to the ports they act on.
#pragma once

#include "core/recursion/constrained_aba/backward_pass.h"
#include "core/recursion/kinematics/poses.h"

namespace ffrobot::recursion {

// What a moment does with the angular acceleration of a marker whose orientation is prescribed
template <class Space, class T>
FFROBOT_INLINE T by_turning(const Attachment &at, const Workspace<Space, T> &w, const T *moment) {
  if constexpr (Space::dim == 6)
    if (at.node < 0 && w.m.ground[at.port].turns)
      return dot(w.turning[at.port].alpha.data(), moment);
  return T(0.);
}

// Of one equation; its second derivative is
//     force . (r_b_ddot - r_a_ddot) + moment_b . Omega_b_dot - moment_a . Omega_a_dot + bias
template <class T> struct ConstraintMotion {
  T value, rate, bias;
  T force[3], moment_a[3], moment_b[3];
};

// The angle of s = B g about n = A f, from A g on: that of its projection on the plane across n. With w = Omega_b -
// Omega_a and z = n . s, s = z n + u, its rate is w . h with h = n - z u / u^2; in the frame of a, s_dot is w x s.
template <class T>
inline void turn_motion(const T *f, const T *g, const Pose<T> &a, const Pose<T> &b, ConstraintMotion<T> &to) {
  T n[3], e[3], s[3], across[3], w[3], s_dot[3], h[3], h_dot[3], turned[3];
  turn(a.R, f, n), turn(a.R, g, e), turn(b.R, g, s), cross(n, e, across);
  for (int i = 0; i < 3; ++i)
    w[i] = b.omega[i] - a.omega[i];
  cross(w, s, s_dot);
  const T z = dot(n, s), z_dot = dot(n, s_dot), share = 1. / (1. - z * z); // of u^2
  for (int i = 0; i < 3; ++i) {
    const T u = s[i] - z * n[i], u_dot = s_dot[i] - z_dot * n[i];
    h[i] = n[i] - z * share * u;
    h_dot[i] = -share * (z_dot * u + z * u_dot + 2. * (z * z * z_dot * share) * u);
    to.moment_a[i] = to.moment_b[i] = h[i];
  }
  cross(a.omega, h, turned);
  to.value = angle_of(dot(across, s), dot(e, s)), to.rate = dot(w, h), to.bias = dot(w, h_dot) + dot(w, turned);
}

// Along n: in space less full turns
template <int dim, class T>
FFROBOT_INLINE void rotation_motion(const T *n, const Pose<T> &a, const Pose<T> &b, ConstraintMotion<T> &to) {
  T omega[3];
  for (int i = 0; i < 3; ++i)
    omega[i] = b.omega[i] - a.omega[i];
  to.rate = dot(n, omega);
  if constexpr (dim == 3)
    to.value = (b.angle - a.angle) * n[2];
  else { // n . log(B A^T)
    T R[3][3], x[3];
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        R[i][j] = dot(b.R[i], a.R[j]);
    logarithm(R, x);
    to.value = dot(n, x);
  }
}

// Way d = r_b - r_a along g = A n, which turns with a
template <class T>
FFROBOT_INLINE void slide_motion(const T *n, const Pose<T> &a, const T *d, const T *d_dot, ConstraintMotion<T> &to) {
  T g[3], gd[3], wg[3], wwg[3];
  turn(a.R, n, g), cross(g, d, gd), cross(a.omega, g, wg), cross(a.omega, wg, wwg);
  to.value = dot(g, d), to.rate = dot(g, d_dot) + dot(a.omega, gd);
  to.bias = 2. * dot(wg, d_dot) + dot(wwg, d);
  for (int i = 0; i < 3; ++i)
    to.force[i] = g[i], to.moment_a[i] = -gd[i];
}

// A n . B g of directions that turn with a and b
template <class T>
FFROBOT_INLINE void dot_motion(const T *n, const T *g_local, const Pose<T> &a, const Pose<T> &b,
                               ConstraintMotion<T> &to) {
  T f[3], g[3], k[3], wf[3], wwf[3], wg[3], wwg[3], relative[3];
  turn(a.R, n, f), turn(b.R, g_local, g), cross(f, g, k);
  cross(a.omega, f, wf), cross(a.omega, wf, wwf), cross(b.omega, g, wg), cross(b.omega, wg, wwg);
  for (int i = 0; i < 3; ++i)
    relative[i] = a.omega[i] - b.omega[i], to.moment_a[i] = to.moment_b[i] = -k[i];
  to.value = dot(f, g), to.rate = dot(relative, k);
  to.bias = dot(wwf, g) + dot(f, wwg) + 2. * dot(wf, wg);
}

// With positions; `n` alone matters where directions do not move and neither value nor rate is asked for.
template <class Space, class T>
FFROBOT_NOINLINE void constraint_motion(const Constraint &constraint, const Workspace<Space, T> &w, bool located,
                                        ConstraintMotion<T> &to) {
  to.value = to.rate = to.bias = T(0.);
  for (int i = 0; i < 3; ++i)
    to.force[i] = to.moment_a[i] = to.moment_b[i] = T(0.);
  const T n[3] = {T(constraint.model.f[0]), T(constraint.model.f[1]), T(constraint.model.f[2])};
  const T second[3] = {T(constraint.model.g[0]), T(constraint.model.g[1]), T(constraint.model.g[2])};
  if (constraint.model.kind == ConstraintKind::point)
    for (int i = 0; i < 3; ++i)
      to.force[i] = n[i];
  if (constraint.model.kind == ConstraintKind::rotation)
    for (int i = 0; i < 3; ++i)
      to.moment_b[i] = to.moment_a[i] = n[i];
  const auto add_turning = [&] {
    if (constraint.follows)
      to.bias += by_turning(constraint.b, w, to.moment_b) - by_turning(constraint.a, w, to.moment_a);
  };
  if (!located)
    return add_turning();
  Pose<T> a, b;
  attachment_pose(constraint.a, w, a), attachment_pose(constraint.b, w, b);
  T d[3], d_dot[3];
  for (int i = 0; i < 3; ++i)
    d[i] = b.r[i] - a.r[i], d_dot[i] = b.v[i] - a.v[i];
  switch (constraint.model.kind) {
  case ConstraintKind::point:
    to.value = dot(n, d), to.rate = dot(n, d_dot);
    break;
  case ConstraintKind::rotation:
    rotation_motion<Space::dim>(n, a, b, to);
    break;
  case ConstraintKind::slide:
    slide_motion(n, a, d, d_dot, to);
    break;
  case ConstraintKind::dot:
    dot_motion(n, second, a, b, to);
    break;
  case ConstraintKind::turn:
    turn_motion(n, second, a, b, to);
    break;
  case ConstraintKind::coordinate:
    break;
  }
  add_turning();
}

// Columns of forces, and a force and a moment (global axes) in axes of a port
template <class T, class Cols>
FFROBOT_INLINE void forces_in_port_axes(const planar::Body &, int, const planar::State<T> &s, const Cols *force,
                                        Cols *to) {
  const T c = s.absolute_cosine, n = s.absolute_sine;
  to[0] = c * force[0] + n * force[1], to[1] = c * force[1] - n * force[0];
}
template <class T, class Cols>
FFROBOT_INLINE void forces_in_port_axes(const spatial::Body &body, int port, const spatial::State<T> &s,
                                        const Cols *force, Cols *to) {
  Cols local[3];
  turn_back(s.absolute, force, local), turn_back(body.ports[port].R, local, to);
}
template <class T>
FFROBOT_INLINE void in_port_axes(const planar::Body &, int, const planar::State<T> &s, const T *force, const T *moment,
                                 T *to) {
  const T c = s.absolute_cosine, n = s.absolute_sine;
  to[0] = c * force[0] + n * force[1], to[1] = c * force[1] - n * force[0], to[2] = moment[2];
}
template <class T>
FFROBOT_INLINE void in_port_axes(const spatial::Body &body, int port, const spatial::State<T> &s, const T *force,
                                 const T *moment, T *to) {
  T local[3];
  turn_back(s.absolute, force, local), turn_back(body.ports[port].R, local, to);
  turn_back(s.absolute, moment, local), turn_back(body.ports[port].R, local, to + 3);
}

// Forces at points, columns along global axes, as columns P of a port
template <class Space, class T, int W, class Body, class State>
FFROBOT_INLINE void write_point_forces(const Body &body, int port, const State &state, const T *from, T *P) {
  constexpr int stride = stride_of(W);
  Pack<T, W> point[Space::linear], turned[Space::linear];
  for (int i = 0; i < Space::linear; ++i)
    point[i] = Pack<T, W>::read(from + i * stride);
  forces_in_port_axes(body, port, state, point, turned);
  for (int i = 0; i < Space::linear; ++i)
    turned[i].write(P + i * stride);
}

// What equations that move measure by velocities and, at the ground, by its acceleration -g; of others that is in
// w.lift
template <class Space, class T, int W>
FFROBOT_INLINE void measure_velocities(const Workspace<Space, T> &w, Delassus<T, W> &S) {
  ConstraintMotion<T> motion;
  for (std::size_t k = 0; k < w.active.size(); ++k) {
    const Constraint &constraint = w.m.constraints[w.active[k]];
    if (!constraint.moves && !constraint.follows)
      continue;
    constraint_motion(constraint, w, constraint.moves, motion);
    T along(0.);
    for (int i = 0; i < Space::linear; ++i)
      along += w.m.gravity[i] * motion.force[i];
    S[k + 1].add(0, -(motion.bias + double((constraint.a.node < 0) - (constraint.b.node < 0)) * along));
  }
}

// What acts on ports before outboard subtrees: constraint equations in their columns, wrenches in column 0.
template <class Space, class T, int W>
FFROBOT_INLINE void act_on_ports(const Forces<T> &forces, Workspace<Space, T> &w, Delassus<T, W> &S) {
  constexpr int d = Space::dim, stride = stride_of(W);
  ConstraintMotion<T> motion;
  T x[d];
  const T *point_force = w.point_force.data();
  for (const auto &actions : w.m.actions) {
    T *P = w.force.data() + actions.global_port * d * stride; // number by number: columns are known at run time
    const auto &body = w.m.nodes[actions.node].body;
    const auto &state = w.bodies[actions.node];
    const bool has_points = W > 1 && actions.has_points;
    for (int i = has_points ? Space::linear : 0; i < d; ++i)
      Pack<T, W>::zero().write(P + i * stride);
    if (has_points)
      write_point_forces<Space, T, W>(body, actions.port, state, point_force, P);
    point_force += Space::linear * stride;
    if (!actions.has_others)
      continue;
    for (const Action &action : actions.list) {
      const int column = action.constraint >= 0 ? w.column[action.constraint] : 0;
      if (action.is_point || (action.constraint >= 0 ? W == 1 || column == 0 : !forces.wrench))
        continue;
      if (action.constraint >= 0) {
        constraint_motion(w.m.constraints[action.constraint], w, w.m.constraints[action.constraint].moves, motion);
        in_port_axes(body, actions.port, state, motion.force, action.sign > 0 ? motion.moment_b : motion.moment_a, x);
      } else {
        const T *from = forces.wrench + action.wrench * d;
        T force[3] = {from[0], from[1], d == 3 ? T(0.) : from[2]}, moment[3] = {T(0.), T(0.), from[d - 1]};
        if constexpr (d == 6)
          moment[0] = from[3], moment[1] = from[4];
        in_port_axes(body, actions.port, state, force, moment, x);
      }
      for (int i = 0; i < d; ++i)
        P[i * stride + column] += action.sign * x[i];
    }
  }
  if (W > 1 && w.m.has_moving_constraints)
    measure_velocities(w, S);
}

} // namespace ffrobot::recursion
