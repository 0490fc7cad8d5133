// The recursion for what most planar mechanisms consist of: a body whose frame's origin sits at a revolute joint, with
// at most one port, which passes forces, and moments that are given along the joint there. Ports have two rows then, Y
// is 2 x 2 in closed form without a subtraction,
//     Y = (Lambda + det Lambda adj G) / (1 + tr Lambda G + det Lambda det G)
// and numbers stay in registers. The same steps as in backward_pass.h and acceleration_pass.h.
//
// Where modes turn the section at the joint by phi = Phi_r p (simply supported links), the recursion is that of the
// frame, which turns by the joint's coordinate less phi; a moment along the coordinate acts on the modes by Phi_r, too,
// and so do the multipliers of rows that are the coordinate: what they do to the modes goes along in their columns.
#pragma once

#include "core/recursion/constrained_aba/acceleration_pass.h"

namespace ffrobot::recursion {

// Lambda of the port's outboard subtree, whose joint is no pin (pins leave theirs there)
template <class T> FFROBOT_INLINE void load_of_pin(int index, Workspace<Planar, T> &w) {
  PortWork<Planar, T> &port = w.ports[index];
  T L[2][2];
  const Hinge<Planar, T> &hinge = w.hinges[w.m.children[index]];
  for (int i = 0; i < 2; ++i)
    for (int j = 0; j < 2; ++j)
      L[i][j] = hinge.Lambda[i][j];
  const T c = hinge.turn.c, n = hinge.turn.s, twice = 2. * (c * n * L[0][1]);
  port.Lambda_xx = c * c * L[0][0] - twice + n * n * L[1][1];
  port.Lambda_yy = n * n * L[0][0] + twice + c * c * L[1][1];
  port.Lambda_xy = c * n * (L[0][0] - L[1][1]) + (c * c - n * n) * L[0][1];
}

// What a moment does to the modes that turn a section by a row of W: along the coordinate of the joint (TILT), and
// that along the joint of the port's outboard subtree.
template <int turn, class T>
inline void add_modal_load(const planar::Body &body, const T &moment, planar::State<T> &s) {
  const auto by_moment = [&](int row) { return s.gram_of_block(turn, row) * moment; };
  for (int r = 0; r < 8; ++r)
    s.Q[r] += by_moment(r);
  if (body.stiffening)
    s.bent.inertia.bx += by_moment(0), s.bent.inertia.by += by_moment(1), s.bent.inertia.ba += by_moment(2);
  else if (body.has_more)
    s.Q[planar::Body::H] += s.WH[turn] * moment;
}

// What acts along the joint's coordinate, by columns; multipliers of constraints that are this coordinate among it.
// Where modes turn the section (TILT), these act on the modes, too.
template <class T, int W> struct AlongPin {
  Pack<T, W> applied, multipliers;
  bool constraints_on_modes;
};

template <class T, int W>
FFROBOT_INLINE AlongPin<T, W> act_along_pin(const Node<Planar> &node, const T *q, const T *v, const T *generalized,
                                            Workspace<Planar, T> &w) {
  const planar::Body &body = node.body;
  planar::State<T> &s = w.bodies[node.index];
  const Pack<T, W> multipliers = multiplier_forces<T, W>(node, 0, w);
  AlongPin<T, W> along{multipliers, multipliers, W > 1 && body.is_tilted && node.has_constraints};
  if (generalized)
    along.applied.set(0, generalized[node.v]);
  forces_on_rows<true>(body, q + node.p_q(), v + node.p_v(), s);
  s.on_modes = s.on_port = T(0.);
  if (body.is_tilted && generalized)
    s.on_modes = generalized[node.v], add_modal_load<planar::Body::TILT>(body, s.on_modes, s);
  if (node.moment_on_port >= 0 && generalized)
    s.on_port = -generalized[node.moment_on_port], add_modal_load<5>(body, s.on_port, s);
  return along;
}

// A symmetric matrix (3, 3)
template <class T> struct PinInertia {
  T xx{0.}, xy{0.}, xa{0.}, yy{0.}, ya{0.}, aa{0.};
};

// The port: H and M = X^T Y X of the child's subtree, its part of C M^-1 C^T
template <class T, int W>
FFROBOT_INLINE PinInertia<T> eliminate_port_of_pin(const Node<Planar> &node, const AlongPin<T, W> &along,
                                                   Workspace<Planar, T> &w, Pack<T, W> *H, Delassus<T, W> &S,
                                                   Pack<T, W> &gamma) {
  constexpr int stride = stride_of(W), tilt = planar::Body::TILT;
  using Cols = Pack<T, W>;
  const planar::Body &body = node.body;
  planar::State<T> &s = w.bodies[node.index];
  const int index = node.first_port;
  const planar::Port &constants = body.ports[0];
  PortWork<Planar, T> &port = w.ports[index];
  const T *u = s.u.data() + 3, *u_dot = s.u_dot.data() + 3, *Q = s.Q.data() + 3;
  const T ww = s.omega * s.omega, w2 = 2. * s.omega;
  T X_xa = s.X_of_block(0, 2) - u[1], X_ya = s.X_of_block(1, 2) + u[0];
  if (body.has_more)
    X_xa -= s.WH[3], X_ya -= s.WH[4];
  port.X_xa = X_xa, port.X_ya = X_ya;
  const T beta_x = Q[0] - ww * (constants.x + u[0]) - w2 * u_dot[1];
  const T beta_y = Q[1] - ww * (constants.y + u[1]) + w2 * u_dot[0];
  port.beta_x = beta_x, port.beta_y = beta_y;
  const T *from = w.force.data() + index * 3 * stride;
  const Cols P0 = Cols::read(from), P1 = Cols::read(from + stride);
  Cols E0 = P0, E1 = P1;
  const bool loaded = node.is_loaded;
  const T Gx = s.gram_of_block(3, 3), Gc = s.gram_of_block(3, 4), Gy = s.gram_of_block(4, 4);
  T Y_xx(0.), Y_xy(0.), Y_yy(0.);
  if (loaded) {
    if (!node.carries_pin)
      load_of_pin(index, w);
    const T Lx = port.Lambda_xx, Lc = port.Lambda_xy, Ly = port.Lambda_yy;
    if (constants.shifts) {
      const T det = Lx * Ly - Lc * Lc, xG = Gx * Lx, yG = Gy * Ly, cG = Gc * Lc;
      const T i = T(1.) / (1. + xG + 2. * cG + yG + (Gx * Gy - Gc * Gc) * det);
      Y_xx = (Lx + Gy * det) * i, Y_yy = (Ly + Gx * det) * i, Y_xy = (Lc - Gc * det) * i;
      const T e00 = (1. + cG + yG) * i, e01 = -((Gc * Lx + Gy * Lc) * i);
      const T e10 = -((Gx * Lc + Gc * Ly) * i), e11 = (1. + xG + cG) * i;
      E0 = e00 * P0 + e01 * P1, E1 = e10 * P0 + e11 * P1;
    } else
      Y_xx = Lx, Y_xy = Lc, Y_yy = Ly;
    port.Y_xx = Y_xx, port.Y_xy = Y_xy, port.Y_yy = Y_yy;
  }
  if constexpr (W > 1) {
    if (constants.shifts) {
      add_dyad(S, P0, Cols(Gx * E0 + Gc * E1));
      add_dyad(S, P1, Cols(Gc * E0 + Gy * E1));
    }
    if (along.constraints_on_modes) { // the port is accelerated by columns, as by other ports in ports.h
      Cols B0 = s.gram_of_block(tilt, 3) * along.multipliers, B1 = s.gram_of_block(tilt, 4) * along.multipliers;
      B0.add(0, beta_x), B1.add(0, beta_y);
      subtract_dyad(S, B0, E0), subtract_dyad(S, B1, E1);
      if (loaded)
        E0 += Y_xx * B0 + Y_xy * B1, E1 += Y_xy * B0 + Y_yy * B1;
      subtract_dyad(S, E0, B0), subtract_dyad(S, E1, B1);
    } else
      gamma += beta_x * E0 + beta_y * E1;
  }
  if (loaded && !along.constraints_on_modes)
    E0.add(0, Y_xx * beta_x + Y_xy * beta_y), E1.add(0, Y_xy * beta_x + Y_yy * beta_y);
  T *stored = w.stored.data() + node.port_slot(0) * stride;
  E0.write(stored), E1.write(stored + stride);
  const T x0 = s.X_of_block(0, 0), x1 = s.X_of_block(0, 1), y0 = s.X_of_block(1, 0), y1 = s.X_of_block(1, 1);
  H[0] = x0 * E0 + y0 * E1, H[1] = x1 * E0 + y1 * E1, H[2] = X_xa * E0 + X_ya * E1;
  PinInertia<T> L;
  if (loaded) {
    const T p0 = x0 * Y_xx + y0 * Y_xy, p1 = x1 * Y_xx + y1 * Y_xy, p2 = X_xa * Y_xx + X_ya * Y_xy;
    const T r0 = x0 * Y_xy + y0 * Y_yy, r1 = x1 * Y_xy + y1 * Y_yy, r2 = X_xa * Y_xy + X_ya * Y_yy;
    L = {x0 * p0 + y0 * r0, x0 * p1 + y0 * r1, x0 * p2 + y0 * r2,
         x1 * p1 + y1 * r1, x1 * p2 + y1 * r2, X_xa * p2 + X_ya * r2};
  }
  return L;
}

// What is left of M (its x, y part) and H (2) once the joint has turned, in axes of the port of the parent: hinge.turn
template <class T, int W>
FFROBOT_INLINE void propagate_pin_to_parent(const Node<Planar> &node, const T &xx, const T &xy, const T &yy,
                                            const Pack<T, W> *H, const Pack<T, W> &applied, Workspace<Planar, T> &w,
                                            Pack<T, W> &gamma) {
  constexpr int stride = stride_of(W);
  using Cols = Pack<T, W>;
  Hinge<Planar, T> &hinge = w.hinges[node.index];
  const T c = hinge.turn.c, n = hinge.turn.s, cn = c * n, twice = 2. * (cn * xy);
  const Cols P0 = c * H[0] - n * H[1], P1 = n * H[0] + c * H[1];
  if (node.parent < 0) {
    if constexpr (W > 1)
      gamma += T(-w.m.gravity[0]) * P0 + T(-w.m.gravity[1]) * P1;
    if (node.is_single_grounded) {
      T *on_ground = w.stored.data() + node.ground_slot() * stride;
      H[0].write(on_ground), H[1].write(on_ground + stride);
      hinge.Lambda[0].set(0, xx), hinge.Lambda[0].set(1, xy), hinge.Lambda[1].set(1, yy);
    }
    return;
  }
  const int index = node.parent_port;
  T *to = w.force.data() + index * 3 * stride;
  const bool add = node.adds_up;
  if (node.parent_is_pin) {
    PortWork<Planar, T> &port = w.ports[index];
    const T cc = c * c, nn = n * n;
    port.Lambda_xx = cc * xx - twice + nn * yy;
    port.Lambda_yy = nn * xx + twice + cc * yy;
    port.Lambda_xy = cn * (xx - yy) + (cc - nn) * xy;
  } else {
    hinge.Lambda[0].set(0, xx), hinge.Lambda[0].set(1, xy), hinge.Lambda[1].set(0, xy), hinge.Lambda[1].set(1, yy);
    (add ? Cols(applied + Cols::read(to + 2 * stride)) : applied).write(to + 2 * stride);
  }
  if (add)
    Cols(P0 + Cols::read(to)).write(to), Cols(P1 + Cols::read(to + stride)).write(to + stride);
  else
    P0.write(to), P1.write(to + stride);
}

template <class T, int W>
FFROBOT_INLINE void eliminate_pin(std::size_t i_node, const T *q, const T *v, const Forces<T> &forces,
                                  Workspace<Planar, T> &w, Delassus<T, W> &S, Pack<T, W> &gamma) {
  constexpr int tilt = planar::Body::TILT;
  using Cols = Pack<T, W>;
  const Node<Planar> &node = w.m.nodes[i_node];
  const planar::Body &body = node.body;
  planar::State<T> &s = w.bodies[i_node];
  const AlongPin<T, W> along = act_along_pin<T, W>(node, q, v, forces.generalized, w);
  PinInertia<T> L;
  Cols H[3];
  if (node.outboard)
    L = eliminate_port_of_pin(node, along, w, H, S, gamma);
  else
    H[0] = H[1] = H[2] = Cols::zero();
  const planar::Inertia<T> I = inertia(body, s);
  const T M_xx = I.xx + L.xx, M_xy = I.xy + L.xy, M_xa = I.xa + L.xa;
  const T M_yy = I.yy + L.yy, M_ya = I.ya + L.ya, M_aa = I.aa + L.aa;
  H[0].add(0, I.bx), H[1].add(0, I.by), H[2].add(0, I.ba - s.on_port);
  if (along.constraints_on_modes) {
    for (int r = 0; r < 3; ++r)
      H[r] += s.gram_of_block(tilt, r) * along.multipliers;
    if (body.has_more)
      H[2] += s.WH[tilt] * along.multipliers;
    Cols turned = s.gram_of_block(tilt, tilt) * along.multipliers;
    turned.add(0, s.Q[tilt]);
    add_dyad(S, along.multipliers, turned);
  }
  // the joint: D = M_aa
  const T D_inverse = T(1.) / M_aa;
  const Cols su = forces.generalized || node.has_constraints ? Cols(H[2] - along.applied) : H[2];
  const Cols sd = D_inverse * su;
  sd.write(w.stored.data() + node.joint_slot(0) * stride_of(W));
  if constexpr (W > 1)
    add_dyad(S, sd, su);
  const T ux = M_xa * D_inverse, uy = M_ya * D_inverse;
  T *U_by_D = w.hinges[i_node].pin;
  U_by_D[0] = ux, U_by_D[1] = uy;
  H[0] -= M_xa * sd, H[1] -= M_ya * sd;
  propagate_pin_to_parent(node, M_xx - M_xa * ux, M_xy - M_xa * uy, M_yy - M_ya * uy, H, along.applied, w, gamma);
}

// Force on the port, into z as well, and its acceleration; on_modes: along the joint's coordinate, of multipliers
template <bool by_multipliers, class T, int W>
FFROBOT_INLINE void accelerate_port_of_pin(const Node<Planar> &node, const T &Ax, const T &Ay, const T &Aa,
                                           const T &on_modes, const T &on_port, bool constraints_on_modes,
                                           Workspace<Planar, T> &w, const Pack<T, W> &y, T *z) {
  constexpr int tilt = planar::Body::TILT;
  const planar::Body &body = node.body;
  planar::State<T> &s = w.bodies[node.index];
  const planar::Port &constants = body.ports[0];
  PortWork<Planar, T> &port = w.ports[node.first_port];
  const T Xx = s.X_of_block(0, 0) * Ax + s.X_of_block(0, 1) * Ay + port.X_xa * Aa;
  const T Xy = s.X_of_block(1, 0) * Ax + s.X_of_block(1, 1) * Ay + port.X_ya * Aa;
  T fx = -superposed(w, node.port_slot(0), y), fy = -superposed(w, node.port_slot(0) + 1, y);
  if (node.is_loaded) // Y beta is among the columns
    fx -= port.Y_xx * Xx + port.Y_xy * Xy, fy -= port.Y_xy * Xx + port.Y_yy * Xy;
  z[3] = fx, z[4] = fy;
  port.f[0] = fx, port.f[1] = fy, port.f[2] = on_port;
  port.A[0] = by_multipliers ? Xx : Xx + port.beta_x, port.A[1] = by_multipliers ? Xy : Xy + port.beta_y;
  T rotation = Aa;
  if (constraints_on_modes) {
    port.A[0] += s.gram_of_block(tilt, 3) * on_modes, port.A[1] += s.gram_of_block(tilt, 4) * on_modes;
    rotation += s.gram_of_block(tilt, 5) * on_modes;
  }
  if (constants.shifts) {
    const T Gx = s.gram_of_block(3, 3), Gc = s.gram_of_block(3, 4), Gy = s.gram_of_block(4, 4);
    port.A[0] += Gx * fx + Gc * fy, port.A[1] += Gc * fx + Gy * fy;
  }
  if (constants.turns) {
    if (!by_multipliers)
      rotation += s.Q[5];
    rotation += s.gram_of_block(5, 3) * fx + s.gram_of_block(5, 4) * fy - s.gram_of_block(5, 0) * Ax -
                s.gram_of_block(5, 1) * Ay - s.gram_of_block(5, 2) * Aa;
    if (body.has_more)
      rotation -= s.WH[5] * Aa;
  }
  port.A[2] = rotation;
}

// A_port (2): acceleration of the inboard port, in and out: of its own port
template <bool by_multipliers, class T, int W>
FFROBOT_INLINE void accelerate_pin(std::size_t i_node, const T *q, Workspace<Planar, T> &w, const Pack<T, W> &y, T *a) {
  const Node<Planar> &node = w.m.nodes[i_node];
  const planar::Body &body = node.body;
  planar::State<T> &s = w.bodies[i_node];
  Hinge<Planar, T> &hinge = w.hinges[i_node];
  T Px, Py, P_rotation(0.);
  if (node.parent < 0)
    Px = T(by_multipliers ? 0. : -w.m.gravity[0]), Py = T(by_multipliers ? 0. : -w.m.gravity[1]);
  else {
    const T *A = w.ports[node.parent_port].A;
    Px = A[0], Py = A[1], P_rotation = A[2];
  }
  const T c = hinge.turn.c, n = hinge.turn.s;
  const T Ax = c * Px + n * Py, Ay = c * Py - n * Px;
  if (node.is_single_grounded) {
    const T xx = hinge.Lambda[0][0], xy = hinge.Lambda[0][1], yy = hinge.Lambda[1][1];
    hinge.f[0] = -(superposed(w, node.ground_slot(), y) + xx * Ax + xy * Ay);
    hinge.f[1] = -(superposed(w, node.ground_slot() + 1, y) + xy * Ax + yy * Ay);
  }
  T Aa = -(superposed(w, node.joint_slot(0), y) + hinge.pin[0] * Ax + hinge.pin[1] * Ay);
  const T *target = W > 1 ? prescribed(node, hinge, w, 0) : nullptr;
  if (target && !body.is_tilted)
    Aa = P_rotation + *target;
  a[node.v] = Aa - P_rotation;
  s.A[0] = Ax, s.A[1] = Ay, s.A[2] = Aa;
  constexpr int tilt = planar::Body::TILT;
  const bool constraints_on_modes = W > 1 && body.is_tilted && node.has_constraints;
  const T on_modes = constraints_on_modes ? multiplier_force<T, W>(node, 0, w, y) : T(0.); // by multipliers
  const T on_port = by_multipliers ? T(0.) : s.on_port;
  T z[8] = {-Ax, -Ay, -Aa, T(0.), T(0.), on_port, by_multipliers ? on_modes : s.on_modes + on_modes, T(0.)};
  if (node.outboard)
    accelerate_port_of_pin<by_multipliers>(node, Ax, Ay, Aa, on_modes, on_port, constraints_on_modes, w, y, z);
  if (body.is_tilted) {
    a[node.v] += s.gram_of_block(tilt, 3) * z[3] + s.gram_of_block(tilt, 4) * z[4] - s.gram_of_block(tilt, 0) * Ax -
                 s.gram_of_block(tilt, 1) * Ay - s.gram_of_block(tilt, 2) * Aa;
    if (constraints_on_modes)
      a[node.v] += s.gram_of_block(tilt, tilt) * on_modes;
    if (!by_multipliers)
      a[node.v] += s.Q[tilt];
    if (body.has_more)
      a[node.v] -= s.WH[tilt] * Aa;
  }
  if (target)
    a[node.v] = *target;
  if (body.n)
    modes_of_pin<by_multipliers>(body, q + node.p_q(), z, s, a + node.p_v());
}

} // namespace ffrobot::recursion
