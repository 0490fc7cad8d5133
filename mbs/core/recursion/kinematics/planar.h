// Outward, in the plane: angles, angular velocities, what velocities do at joints.
#pragma once

#include "core/recursion/mechanism/workspace.h"
#include "core/recursion/numbers/sines.h"
#include "core/recursion/numbers/small.h"
#include "core/recursion/planar/inertia.h"
#include <cstddef>

namespace ffrobot::recursion {

// Takes angles one after the other and leaves their sines and cosines: of doubles four at once. They are put together
// in a register, since written one by one and read together they would wait for memory.
template <class T> struct Angles {
  FFROBOT_INLINE void take(std::size_t i, std::size_t, const T &x, T *s, T *c) { sine_and_cosine(x, s[i], c[i]); }
};
template <> struct Angles<double> {
  FourDoubles four{};
  FFROBOT_INLINE void take(std::size_t i, std::size_t count, double x, double *s, double *c) {
    using Integers = std::int64_t __attribute__((vector_size(32)));
    const std::size_t lane = i % 4;
    four = Integers{0, 1, 2, 3} == Integers{} + static_cast<std::int64_t>(lane) ? x - FourDoubles{} : four;
    if (lane != 3 && i + 1 != count)
      return;
    sines_and_cosines(four, s + (i - lane), c + (i - lane));
  }
};

// Angle of the section at a port against the body
template <class T> FFROBOT_INLINE T section_angle(const planar::Body &b, int port, const planar::State<T> &s) {
  return b.ports[port].angle + s.u[b.ports[port].row + 2];
}

template <class T>
FFROBOT_NOINLINE void kinematics(const T *q, const T *v, const Forces<T> &forces, Workspace<Planar, T> &w) {
  const std::size_t count = w.hinges.size();
  Angles<T> angles;
  for (std::size_t i = 0; i < count; ++i) {
    const Node<Planar> &node = w.m.nodes[i];
    planar::State<T> &s = w.bodies[i];
    project(node.body, q + node.p_q(), v + node.p_v(), forces.generalized ? forces.generalized + node.p_v() : nullptr,
            s);
    if (node.body.stiffening)
      bend(node.body, q + node.p_q(), v + node.p_v(), s);
    T angle = T(node.inner_angle);
    if (node.parent >= 0)
      angle += w.bodies[node.parent].u[node.inner_rotation];
    if (node.angle >= 0)
      angle += q[node.angle];
    if (node.body.is_tilted)
      angle -= s.u[planar::Body::TILT];
    angles.take(i, count, angle, w.sine.data(), w.cosine.data());
  }
  for (std::size_t i = 0; i < count; ++i) {
    const Node<Planar> &node = w.m.nodes[i];
    planar::State<T> &s = w.bodies[i];
    Hinge<Planar, T> &hinge = w.hinges[i];
    const T cosine = w.cosine[i], sine = w.sine[i];
    hinge.turn = {cosine, sine};
    T omega(0.); // of the inboard section
    if (node.parent >= 0) {
      const planar::State<T> &p = w.bodies[node.parent];
      omega = p.omega + p.u_dot[node.inner_rotation];
      s.absolute_cosine = p.absolute_cosine * cosine - p.absolute_sine * sine;
      s.absolute_sine = p.absolute_sine * cosine + p.absolute_cosine * sine;
    } else
      s.absolute_cosine = cosine, s.absolute_sine = sine;
    if (node.rotor_inertia > 0)
      hinge.spin = node.rotor_turns * omega + node.gear_ratio * v[node.v];
    if (node.joint == JointKind::revolute)
      s.omega = omega + (node.body.is_tilted ? T(v[node.v] - s.u_dot[planar::Body::TILT]) : v[node.v]);
    else {
      PlanarPlace<T> to;
      place(node.joint, node.lead, q + node.q, v + node.v, to);
      s.omega = omega + to.rate;
      const T oo = omega * omega, o2 = 2. * omega;
      for (int k = 0; k < 2; ++k)
        hinge.r[k] = to.r[k], hinge.r_dot[k] = to.r_dot[k];
      hinge.c[0] = -(oo * to.r[0]) - o2 * to.r_dot[1], hinge.c[1] = o2 * to.r_dot[0] - oo * to.r[1], hinge.c[2] = T(0.);
    }
    if (!node.parent_is_pin) {
      hinge.column[0][0] = cosine, hinge.column[0][1] = sine, hinge.column[0][2] = -hinge.r[1];
      hinge.column[1][0] = -sine, hinge.column[1][1] = cosine, hinge.column[1][2] = hinge.r[0];
      hinge.column[2][2] = T(1.);
    }
    if (node.inboard >= 0) { // from the section to the frame
      T c, n;
      sine_and_cosine(section_angle(node.body, node.inboard, s), n, c);
      s.omega -= s.u_dot[node.body.ports[node.inboard].row + 2];
      s.cosine = c, s.sine = n;
      const T ac = s.absolute_cosine, as = s.absolute_sine;
      s.absolute_cosine = ac * c + as * n, s.absolute_sine = as * c - ac * n;
    }
  }
}

// --- the general path

// Axes of the body by those of the section at the inboard port
template <class T> FFROBOT_INLINE PlanarTurn<T> inboard_tilt(const Node<Planar> &, const planar::State<T> &s) {
  return {s.cosine, s.sine};
}

template <class T>
FFROBOT_NOINLINE void evaluate_inertia(const Node<Planar> &node, const T *p, const T *v, planar::State<T> &s,
                                       Pack<T, 3> *M, T *b) {
  forces_on_rows(node.body, p, v, s);
  const planar::Inertia<T> I = inertia(node.body, s);
  const T rows[3][3] = {{I.xx, I.xy, I.xa}, {I.xy, I.yy, I.ya}, {I.xa, I.ya, I.aa}};
  for (int i = 0; i < 3; ++i) {
    M[i] = Pack<T, 3>::zero();
    for (int j = 0; j < 3; ++j)
      M[i].set(j, rows[i][j]);
  }
  b[0] = I.bx, b[1] = I.by, b[2] = I.ba;
}

template <class T>
FFROBOT_NOINLINE void port_gram(const planar::Body &b, const planar::State<T> &s, int i, int j, Pack<T, 3> *G) {
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c)
      G[r].set(c, s.gram(b, b.ports[i].row + r, b.ports[j].row + c));
}

template <class T>
FFROBOT_NOINLINE void port_rows(const planar::Body &b, int i, planar::State<T> &s, Pack<T, 3> *X, T *beta,
                                Pack<T, 3> *G) {
  const planar::Port &port = b.ports[i];
  const T *u = s.u.data() + port.row, *u_dot = s.u_dot.data() + port.row, *Q = s.Q.data() + port.row;
  const T ww = s.omega * s.omega, w2 = 2. * s.omega;
  const T *constant = s.X(b, i);
  T column[3] = {constant[2] - u[1], constant[5] + u[0], constant[8]};
  if (b.has_more)
    for (int r = 0; r < 3; ++r)
      column[r] -= s.WH[port.row + r];
  for (int r = 0; r < 3; ++r) {
    X[r].set(0, constant[3 * r]), X[r].set(1, constant[3 * r + 1]), X[r].set(2, column[r]);
  }
  beta[0] = Q[0] - ww * (port.x + u[0]) - w2 * u_dot[1];
  beta[1] = Q[1] - ww * (port.y + u[1]) + w2 * u_dot[0];
  beta[2] = Q[2];
  if (port.is_flexible)
    port_gram(b, s, i, i, G);
}

template <class T>
FFROBOT_INLINE void put_force(const planar::Body &b, const planar::State<T> &, int i, const T *f, T *z) {
  for (int r = 0; r < 3; ++r)
    z[b.ports[i].row + r] = f[r];
}

template <bool by_multipliers, class T>
FFROBOT_NOINLINE void modes(const Node<Planar> &node, const T *p, T *z, planar::State<T> &s, T *a) {
  modal_accelerations<by_multipliers>(node.body, p, z, s, a);
}

template <class T> FFROBOT_INLINE void ground_acceleration(const Mechanism<Planar> &m, int, T *A) {
  A[0] = T(-m.gravity[0]), A[1] = T(-m.gravity[1]), A[2] = T(0.);
}

// y = R x from axes of a port to global ones
template <class X, class T>
FFROBOT_INLINE void port_to_global(const planar::Body &, int, const planar::State<T> &s, const X *x, X *y) {
  PlanarTurn<T>{s.absolute_cosine, s.absolute_sine}.apply(x, y);
}

// Accelerations from unit freedoms of the outer section to the rates of joint coordinates, whose translations are along
// inner axes, and forces back: to axes of the inner section, or of the outer one
template <bool to_inner, class T>
FFROBOT_INLINE void change_section(const Node<Planar> &, const T *q, const T *x, T *y) {
  T s, c;
  sine_and_cosine(q[2], s, c);
  PlanarTurn<T>{c, to_inner ? s : -s}.apply(x, y);
}

} // namespace ffrobot::recursion
