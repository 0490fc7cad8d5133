// Where things are, and what constraint rows and wrenches do to the ports they act on.
#pragma once

#include "core/recursion/articulated.h"

namespace ffrobot::recursion {

// --- frames and sections in global axes, after kinematics()

// Motions are poses without axes, which take sines or products of matrices.

template <class T> FFROBOT_INLINE void ground_motion(const PlanarMarker &marker, Pose<T> &to) {
  for (int i = 0; i < 3; ++i)
    to.r[i] = T(i < 2 ? marker.position[i] : 0.), to.v[i] = to.omega[i] = T(0.);
  to.angle = T(marker.angle);
}
template <class T> FFROBOT_INLINE void ground_axes(const PlanarMarker &marker, Pose<T> &to) {
  const double c = std::cos(marker.angle), s = std::sin(marker.angle);
  const double R[3][3] = {{c, -s, 0}, {s, c, 0}, {0, 0, 1}};
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      to.R[i][j] = T(R[i][j]);
}
template <class T> FFROBOT_INLINE void ground_motion(const SpatialMarker &marker, Pose<T> &to) {
  for (int i = 0; i < 3; ++i)
    to.r[i] = T(marker.position[i]), to.v[i] = to.omega[i] = T(0.);
  to.angle = T(0.);
}
template <class T> FFROBOT_INLINE void ground_axes(const SpatialMarker &marker, Pose<T> &to) {
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      to.R[i][j] = T(marker.triad(i, j));
}

// Of a section of a body whose frame is known
template <class T>
inline void section_motion(const planar::Body &body, int port, const planar::State<T> &s, const Pose<T> &frame,
                           Pose<T> &to) {
  const planar::Port &constants = body.ports[port];
  const T *u = s.u.data() + constants.row, *u_dot = s.u_dot.data() + constants.row;
  const T x = constants.x + u[0], y = constants.y + u[1];
  const T x_dot = u_dot[0] - s.omega * y, y_dot = u_dot[1] + s.omega * x;
  const T c = s.absolute_cosine, n = s.absolute_sine;
  to.r[0] = frame.r[0] + c * x - n * y, to.r[1] = frame.r[1] + n * x + c * y, to.r[2] = T(0.);
  to.v[0] = frame.v[0] + c * x_dot - n * y_dot, to.v[1] = frame.v[1] + n * x_dot + c * y_dot, to.v[2] = T(0.);
  to.omega[0] = to.omega[1] = T(0.), to.omega[2] = s.omega + u_dot[2];
  to.angle = frame.angle + constants.angle + u[2];
}
template <class T>
inline void section_axes(const planar::Body &, int, const planar::State<T> &, Pose<T> &to) { // after section_motion()
  T sine, cosine;
  sine_and_cosine(to.angle, sine, cosine);
  const T R[3][3] = {{cosine, -sine, T(0.)}, {sine, cosine, T(0.)}, {T(0.), T(0.), T(1.)}};
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      to.R[i][j] = R[i][j];
}
template <class T>
inline void section_motion(const spatial::Body &body, int port, const spatial::State<T> &s, const Pose<T> &frame,
                           Pose<T> &to) {
  const spatial::Port &constants = body.ports[port];
  const spatial::PortMotion<T> &motion = s.ports[port];
  T r[3], v[3], omega[3], turned[3];
  turn(s.absolute, motion.r, r);
  cross(s.omega, motion.r, v);
  for (int i = 0; i < 3; ++i)
    omega[i] = s.omega[i];
  if (constants.is_soft) {
    turn(constants.R, s.u_dot.data() + constants.row, turned);
    for (int i = 0; i < 3; ++i)
      v[i] += turned[i];
    turn(constants.R, motion.rate, turned);
    for (int i = 0; i < 3; ++i)
      omega[i] += turned[i];
  }
  turn(s.absolute, v, turned);
  turn(s.absolute, omega, to.omega);
  for (int i = 0; i < 3; ++i)
    to.r[i] = frame.r[i] + r[i], to.v[i] = frame.v[i] + turned[i];
  to.angle = T(0.);
}
template <class T>
inline void section_axes(const spatial::Body &body, int port, const spatial::State<T> &s, Pose<T> &to) {
  const spatial::Port &constants = body.ports[port];
  product(s.absolute, constants.R, to.R);
  if (constants.is_soft) {
    T axes[3][3];
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j)
        axes[i][j] = to.R[i][j];
    product(axes, s.ports[port].turn, to.R);
  }
}
template <class Body, class State, class T>
inline void section_pose(const Body &body, int port, const State &s, const Pose<T> &frame, Pose<T> &to) {
  section_motion(body, port, s, frame, to), section_axes(body, port, s, to);
}

template <class T> FFROBOT_INLINE void frame_axes(const planar::State<T> &s, Pose<T> &to) {
  const T c = s.absolute_cosine, n = s.absolute_sine;
  const T R[3][3] = {{c, -n, T(0.)}, {n, c, T(0.)}, {T(0.), T(0.), T(1.)}};
  for (int i = 0; i < 3; ++i) {
    to.omega[i] = i == 2 ? s.omega : T(0.);
    for (int j = 0; j < 3; ++j)
      to.R[i][j] = R[i][j];
  }
}
template <class T> FFROBOT_INLINE void frame_axes(const spatial::State<T> &s, Pose<T> &to) {
  turn(s.absolute, s.omega, to.omega);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      to.R[i][j] = s.absolute[i][j];
}

template <class T> FFROBOT_INLINE T joint_angle(const Node<Planar> &node, const T *q, const planar::State<T> &s) {
  if (node.joint == JointKind::revolute)
    return node.body.is_tilted ? T(q[node.q] - s.u[planar::Body::TILT]) : q[node.q];
  return node.joint == JointKind::free ? q[node.q + 2] : T(0.);
}
template <class T> FFROBOT_INLINE T joint_angle(const Node<Spatial> &, const T *, const spatial::State<T> &) {
  return T(0.);
}

// Of all frames: w.frames
template <class Space, class T>
FFROBOT_APART void locate(const Mechanism<Space> &m, const T *q, Workspace<Space, T> &w) {
  for (std::size_t i = 0; i < m.nodes.size(); ++i) {
    const Node<Space> &node = m.nodes[i];
    const Hinge<Space, T> &hinge = w.hinges[i];
    Pose<T> inner, at{};
    if (node.parent < 0)
      ground_motion(m.ground[node.parent_port], inner);
    else
      section_motion(m.nodes[node.parent].body, node.parent_port - m.nodes[node.parent].first_port,
                     w.bodies[node.parent], w.frames[node.parent], inner);
    Pose<T> &frame = w.frames[i];
    frame_axes(w.bodies[i], frame);
    // origin and velocity of the outer section; its axes are those of the frame, or of the inboard port
    frame.angle = inner.angle + joint_angle(node, q, w.bodies[i]);
    T r[3] = {T(0.), T(0.), T(0.)}, r_dot[3] = {T(0.), T(0.), T(0.)}, arm[3], rate[3], swept[3];
    for (int k = 0; k < 3; ++k)
      at.r[k] = at.v[k] = T(0.);
    Pose<T> local = frame, section = frame;
    if (node.inboard >= 0) {
      for (int k = 0; k < 3; ++k)
        local.r[k] = local.v[k] = T(0.);
      local.angle = T(0.);
      section_pose(node.body, node.inboard, w.bodies[i], local, section); // relative to the frame's origin
      if constexpr (Space::dim == 3) { // section_pose measures angles from the frame's
        const T tilt = section_angle(node.body, node.inboard, w.bodies[i]);
        frame.angle -= tilt;
        T s, c;
        sine_and_cosine(frame.angle + tilt, s, c);
        section.R[0][0] = c, section.R[0][1] = -s, section.R[1][0] = s, section.R[1][1] = c;
      }
    }
    for (int k = 0; k < Space::linear; ++k)
      r[k] = hinge.r[k], r_dot[k] = hinge.r_dot[k];
    turn(section.R, r, arm), turn(section.R, r_dot, rate), cross(inner.omega, arm, swept);
    for (int k = 0; k < 3; ++k) {
      frame.r[k] = inner.r[k] + arm[k], frame.v[k] = inner.v[k] + swept[k] + rate[k];
      if (node.inboard >= 0)
        frame.r[k] -= section.r[k], frame.v[k] -= section.v[k];
    }
  }
}

template <class Space, class T>
FFROBOT_INLINE void attachment_motion(const Mechanism<Space> &m, const Attachment &at, const Workspace<Space, T> &w,
                                      Pose<T> &to) {
  if (at.node >= 0)
    return section_motion(m.nodes[at.node].body, at.port, w.bodies[at.node], w.frames[at.node], to);
  ground_motion(m.ground[at.port], to);
  if constexpr (Space::dim == 6)
    if (m.ground[at.port].turns)
      for (int i = 0; i < 3; ++i)
        to.omega[i] = T(w.turning[at.port].omega[i]);
}

template <class Space, class T>
FFROBOT_INLINE void attachment_pose(const Mechanism<Space> &m, const Attachment &at, const Workspace<Space, T> &w,
                                    Pose<T> &to) {
  attachment_motion(m, at, w, to);
  if (at.node >= 0)
    return section_axes(m.nodes[at.node].body, at.port, w.bodies[at.node], to);
  ground_axes(m.ground[at.port], to);
  if constexpr (Space::dim == 6)
    if (m.ground[at.port].turns)
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j)
          to.R[i][j] = T(w.turning[at.port].A(i, j));
}

// What a moment does with the angular acceleration of a marker that turns as it is told
template <class Space, class T>
FFROBOT_INLINE T by_turning(const Mechanism<Space> &m, const Attachment &at, const Workspace<Space, T> &w,
                            const T *moment) {
  if constexpr (Space::dim == 6)
    if (at.node < 0 && m.ground[at.port].turns)
      return dot(w.turning[at.port].alpha.data(), moment);
  return T(0.);
}

// --- rows: value, rate, and second derivative
//     force . (r_b_ddot - r_a_ddot) + moment_b . Omega_b_dot - moment_a . Omega_a_dot + bias

// n . log(B A^T)
template <class T> inline T turn_about(const T *n, const T (&A)[3][3], const T (&B)[3][3]) {
  T R[3][3], x[3];
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      R[i][j] = dot(B[i], A[j]);
  logarithm(R, x);
  return dot(n, x);
}

// From a to b, and its rate
template <class Space, class T>
FFROBOT_INLINE void separation(const Mechanism<Space> &m, const Row &row, const Workspace<Space, T> &w, T *d,
                               T *d_dot) {
  Pose<T> a, b;
  attachment_motion(m, row.a, w, a), attachment_motion(m, row.b, w, b);
  for (int i = 0; i < 3; ++i)
    d[i] = b.r[i] - a.r[i], d_dot[i] = b.v[i] - a.v[i];
}

template <class T> struct RowMotion {
  T value, rate, bias;
  T force[3], moment_a[3], moment_b[3];
};

// The angle of s = B g about n = A f, from A g on: that of its projection on the plane across n. With w = Omega_b -
// Omega_a and z = n . s, s = z n + u, its rate is w . h with h = n - z u / u^2; in the frame of a, s_dot is w x s.
template <class T>
inline void turn_motion(const T *f, const T *g, const Pose<T> &a, const Pose<T> &b, RowMotion<T> &to) {
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

// With positions; `n` alone matters where directions do not move and neither value nor rate is asked for.
template <class Space, class T>
FFROBOT_APART void row_motion(const Mechanism<Space> &m, const Row &row, const Workspace<Space, T> &w, bool located,
                              RowMotion<T> &to) {
  to.value = to.rate = to.bias = T(0.);
  for (int i = 0; i < 3; ++i)
    to.force[i] = to.moment_a[i] = to.moment_b[i] = T(0.);
  T n[3] = {T(row.model.f[0]), T(row.model.f[1]), T(row.model.f[2])};
  if (row.model.kind == RowKind::point)
    for (int i = 0; i < 3; ++i)
      to.force[i] = n[i];
  if (row.model.kind == RowKind::rotation)
    for (int i = 0; i < 3; ++i)
      to.moment_b[i] = to.moment_a[i] = n[i];
  const auto add_turning = [&] {
    if (row.follows)
      to.bias += by_turning(m, row.b, w, to.moment_b) - by_turning(m, row.a, w, to.moment_a);
  };
  if (!located)
    return add_turning();
  Pose<T> a, b;
  attachment_pose(m, row.a, w, a), attachment_pose(m, row.b, w, b);
  T d[3], d_dot[3];
  for (int i = 0; i < 3; ++i)
    d[i] = b.r[i] - a.r[i], d_dot[i] = b.v[i] - a.v[i];
  switch (row.model.kind) {
  case RowKind::point:
    to.value = dot(n, d), to.rate = dot(n, d_dot);
    break;
  case RowKind::rotation: {
    T omega[3];
    for (int i = 0; i < 3; ++i)
      omega[i] = b.omega[i] - a.omega[i];
    to.rate = dot(n, omega);
    if constexpr (Space::dim == 3)
      to.value = (b.angle - a.angle) * n[2];
    else
      to.value = turn_about(n, a.R, b.R);
    break;
  }
  case RowKind::slide: {
    T g[3], gd[3], wg[3], wwg[3];
    turn(a.R, n, g), cross(g, d, gd), cross(a.omega, g, wg), cross(a.omega, wg, wwg);
    to.value = dot(g, d), to.rate = dot(g, d_dot) + dot(a.omega, gd);
    to.bias = 2. * dot(wg, d_dot) + dot(wwg, d);
    for (int i = 0; i < 3; ++i)
      to.force[i] = g[i], to.moment_a[i] = -gd[i];
    break;
  }
  case RowKind::dot: {
    const T g_local[3] = {T(row.model.g[0]), T(row.model.g[1]), T(row.model.g[2])};
    T f[3], g[3], k[3], wf[3], wwf[3], wg[3], wwg[3], relative[3];
    turn(a.R, n, f), turn(b.R, g_local, g), cross(f, g, k);
    cross(a.omega, f, wf), cross(a.omega, wf, wwf), cross(b.omega, g, wg), cross(b.omega, wg, wwg);
    for (int i = 0; i < 3; ++i)
      relative[i] = a.omega[i] - b.omega[i], to.moment_a[i] = to.moment_b[i] = -k[i];
    to.value = dot(f, g), to.rate = dot(relative, k);
    to.bias = dot(wwf, g) + dot(f, wwg) + 2. * dot(wf, wg);
    break;
  }
  case RowKind::turn: {
    const T g[3] = {T(row.model.g[0]), T(row.model.g[1]), T(row.model.g[2])};
    turn_motion(n, g, a, b, to);
    break;
  }
  case RowKind::coordinate:
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

// What acts on ports before anything that hangs there: rows in their columns, wrenches in column 0. Of rows that move,
// S gets what they measure by velocities and, at the ground, by its acceleration -g; of others that is in w.lift.
template <class Space, class T, int W>
FFROBOT_INLINE void attach_all(const Mechanism<Space> &m, const Forces<T> &forces, Workspace<Space, T> &w,
                               Schur<T, W> &S) {
  constexpr int d = Space::dim, stride = stride_of(W);
  using Cols = Pack<T, W>;
  RowMotion<T> motion;
  T x[d];
  const T *point_force = w.point_force.data();
  for (const auto &actions : m.actions) {
    T *P = w.force.data() + actions.global_port * d * stride; // number by number: columns are known at run time
    const auto &body = m.nodes[actions.node].body;
    const auto &state = w.bodies[actions.node];
    const bool has_points = W > 1 && actions.has_points;
    for (int i = has_points ? Space::linear : 0; i < d; ++i)
      Cols::zero().write(P + i * stride);
    if (has_points) {
      Cols point[Space::linear], turned[Space::linear];
      for (int i = 0; i < Space::linear; ++i)
        point[i] = Cols::read(point_force + i * stride);
      forces_in_port_axes(body, actions.port, state, point, turned);
      for (int i = 0; i < Space::linear; ++i)
        turned[i].write(P + i * stride);
    }
    point_force += Space::linear * stride;
    if (!actions.has_others)
      continue;
    for (const Action &action : actions.list) {
      const int column = action.row >= 0 ? w.column[action.row] : 0;
      if (action.is_point || (action.row >= 0 ? W == 1 || column == 0 : !forces.wrench))
        continue;
      if (action.row >= 0) {
        row_motion(m, m.rows[action.row], w, m.rows[action.row].moves, motion);
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
  if (W == 1 || !m.has_moving_rows)
    return;
  for (std::size_t k = 0; k < w.active.size(); ++k) {
    const Row &row = m.rows[w.active[k]];
    if (!row.moves && !row.follows)
      continue;
    row_motion(m, row, w, row.moves, motion);
    T along(0.);
    for (int i = 0; i < Space::linear; ++i)
      along += m.gravity[i] * motion.force[i];
    S[k + 1].add(0, -(motion.bias + double((row.a.node < 0) - (row.b.node < 0)) * along));
  }
}

} // namespace ffrobot::recursion
