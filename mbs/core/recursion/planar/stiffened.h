// What geometric stiffening changes of a planar body, as spatial/stiffened.h has it of one in space.
#pragma once

#include "core/recursion/planar/body.h"

namespace ffrobot::recursion::planar {

// i: fields turned by a right angle, i (x, y, stretch, turn) = (-y, x, -turn, stretch)
template <class T> FFROBOT_INLINE Pack<T, fields> quarter_turn(const Pack<T, fields> &x) {
  auto to = Pack<T, fields>::zero();
  to.set(0, -x[1]), to.set(1, x[0]), to.set(2, -x[3]), to.set(3, x[2]);
  return to;
}

// F(p), and g with its rate, of the linear body and with terms of second order
template <class T> inline void bend_fields(const Body &b, State<T> &s) {
  const Stiffening &k = *b.stiffening;
  Bent<T> &bent = s.bent;
  bent.linear.g = constant_row<fields, T>(k.g), bent.linear.g_dot = Pack<T, fields>::zero();
  for (int i = 0; i < b.n; ++i) {
    const double *F = k.F.data() + fields * i;
    add_scaled(bent.p[i], F, bent.linear.g), add_scaled(bent.v[i], F, bent.linear.g_dot);
    constant_row<fields, T>(F).write(bent.F.data() + fields * i);
  }
  bent.all = bent.linear;
  for (int f = 0; f < fields; ++f) {
    const Curve<T> second = curve<T>(k.K[f], b.n, bent.p.data(), bent.v.data(), bent.K_p.data(), bent.K_v.data(),
                                     bent.F.data() + f, fields);
    bent.all.g.add(f, -second.half), bent.all.g_dot.add(f, -second.rate), bent.bending.set(f, second.bending);
  }
}

// Takes what bending does to second order, after W p and W p_dot: to the first moment, at ports, to rows of W
template <class T> FFROBOT_NOINLINE void bend(const Body &b, const T *p, const T *v, State<T> &s) {
  const Stiffening &k = *b.stiffening;
  Bent<T> &bent = s.bent;
  const int width = b.width();
  read_modes(p, b.n, bent.p.data()), read_modes(v, b.n, bent.v.data());
  bend_fields(b, s);
  for (int i = 0; i < b.n * width; ++i)
    bent.rows[i] = T(b.columns[i]);
  for (const Stiffening::Row &at : k.at_ports) {
    const Curve<T> second = curve<T>(at.K, b.n, bent.p.data(), bent.v.data(), bent.K_p.data(), bent.K_v.data(),
                                     bent.rows.data() + at.row, width);
    s.u[at.row] -= second.half, s.u_dot[at.row] -= second.rate;
    bent.curvature[at.row] = second.bending;
  }
  const double s0[2] = {b.sx, b.sy};
  for (int c = 0; c < 2; ++c) {
    s.u[c] = k.root_mass * bent.all.g[c] - s0[c], s.u_dot[c] = k.root_mass * bent.all.g_dot[c];
    bent.curvature[c] = k.root_mass * bent.bending[c];
    for (int i = 0; i < b.n; ++i)
      bent.rows[i * width + c] = k.root_mass * bent.F[i * fields + c];
  }
}

// Row h, forces on the modes, and what J has beyond J + p.p, with its rate, after `modal_forces`
template <class T> inline void bend_forces(const Body &b, const T *p, const T *v, State<T> &s) {
  using Fields = Pack<T, fields>;
  Bent<T> &bent = s.bent;
  const auto &linear = bent.linear, &all = bent.all;
  const T w = s.omega, ww = w * w, w2 = 2. * w;
  const Fields turned = quarter_turn(all.g), turned_linear = quarter_turn(linear.g);
  const Fields y = w2 * quarter_turn(all.g_dot) - ww * all.g - bent.bending; // accelerations by velocities
  const Fields y_linear = w2 * quarter_turn(linear.g_dot) - ww * linear.g;
  T h_p_dot(0.);
  for (int i = 0; i < b.n; ++i) {
    const Fields F = constant_row<fields, T>(b.stiffening->F.data() + fields * i),
                 F_p = Fields::read(bent.F.data() + fields * i);
    T *row = bent.rows.data() + i * b.width();
    row[Body::H] = b.columns[i * b.width() + Body::H] + s.h[i] + (turned * F_p - turned_linear * F).sum();
    row[Bent<T>::FORCE] = ww * p[i] - s.elastic[i] + s.more[i] + (y_linear * F - y * F_p).sum();
    h_p_dot += row[Body::H] * v[i];
    s.h[i] = T(0.); // is part of row h
  }
  s.u_dot[Body::H] = h_p_dot;
  s.p_p += (all.g * all.g - linear.g * linear.g).sum();
  s.p_v += (all.g * all.g_dot - linear.g * linear.g_dot).sum();
  bent.curvature[Body::H] = (turned * bent.bending).sum();
}

// m_ff = 1 - F^T F + F(p)^T F(p), products of rows, X of ports, and what rows accelerate by: W m_ff^-1 Q_f less
// curvature
template <class T> inline void eliminate_modes(const Body &b, State<T> &s) {
  Bent<T> &bent = s.bent;
  const int n = b.n, width = b.width();
  for (int i = 0; i < n; ++i) {
    const auto F_i = Pack<T, fields>::read(bent.F.data() + fields * i);
    for (int j = 0; j <= i; ++j)
      bent.factor[i * n + j] =
          b.stiffening->m_ff_rest[i * n + j] + (F_i * Pack<T, fields>::read(bent.F.data() + fields * j)).sum();
  }
  bent.eliminate();
  bent.multiply(s.products.data());
  for (int r = 0; r < width; ++r)
    s.Q[r] = s.gram(b, r, Bent<T>::FORCE) - bent.curvature[r];
  T *X = s.products.data() + width * width;
  for (const Port &port : b.ports) {
    const double rigid[3][3] = {{1, 0, -port.y}, {0, 1, port.x}, {0, 0, 1}};
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c)
        *X++ = rigid[r][c] - s.gram(b, port.row + r, c);
  }
}

// What `inertia` answers then, after `modal_forces`
template <class T> FFROBOT_NOINLINE Inertia<T> bent_inertia(const Body &b, const T *p, const T *v, State<T> &s) {
  bend_forces(b, p, v, s);
  eliminate_modes(b, s);
  const T ww = s.omega * s.omega, w2 = 2. * s.omega;
  const T sx = b.sx + s.u[Body::Sx], sy = b.sy + s.u[Body::Sy];
  const T *G = s.products.data(), *Q = s.Q.data();
  const int width = b.width();
  Inertia<T> M;
  M.xx = b.mass - G[0], M.xy = -G[1], M.xa = -sy - G[2];
  M.yy = b.mass - G[width + 1], M.ya = sx - G[width + 2], M.aa = b.J + s.p_p - G[2 * width + 2];
  M.bx = Q[Body::Sx] - (ww * sx + w2 * s.u_dot[Body::Sy]), M.by = Q[Body::Sy] - (ww * sy - w2 * s.u_dot[Body::Sx]);
  M.ba = Q[Body::H] + w2 * s.p_v;
  return M;
}

// What m_ff has beyond 1, in 1/2 p_dot^T m_ff p_dot
inline double bending_energy(const State<double> &s) {
  const auto &all = s.bent.all, &linear = s.bent.linear;
  return 0.5 * (all.g_dot * all.g_dot - linear.g_dot * linear.g_dot).sum();
}

} // namespace ffrobot::recursion::planar
