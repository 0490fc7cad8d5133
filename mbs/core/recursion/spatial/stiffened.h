// What geometric stiffening changes of a body in space: its inertia, rows and forces are those of the linear body, less
// what affine fields have of them there, and what they have with terms of second order (stiffening.h). The mass matrix
// of the modes is then no longer 1 (bent_modes.h).
#pragma once

#include "core/recursion/spatial/state.h"

namespace ffrobot::recursion::spatial {

// s.b and s.h_change[0] are used in between.
template <class T> inline Curve<T> curve(const ModeMatrix &K, int n, State<T> &s, T *row, int stride) {
  return curve<T>(K, n, s.p.data(), s.v.data(), s.b.data(), s.h_change[0].data(), row, stride);
}

// F(p), and g with its rate, of the linear body and with terms of second order
template <class T> inline void bend_fields(const Body &b, State<T> &s) {
  const Stiffening &k = *b.stiffening;
  Bent<T> &bent = s.bent;
  for (int c = 0, i = 0; c < 3; ++c)
    for (int f = 0; f < k.fields; ++f, ++i) {
      const double *F = k.row(i, b.n);
      T *row = bent.F.data() + i * padded(b.n), moved(0.), rate(0.);
      for (int j = 0; j < b.n; ++j)
        row[j] = T(F[j]), moved += F[j] * s.p[j], rate += F[j] * s.v[j];
      const auto second = curve(k.K[i], b.n, s, row, 1);
      bent.linear.g[c][f] = moved + k.g[c][f], bent.linear.g_dot[c][f] = rate;
      bent.all.g[c][f] = bent.linear.g[c][f] - second.half, bent.all.g_dot[c][f] = rate - second.rate;
      bent.bending[c][f] = second.bending;
    }
}

// Takes what bending does to second order, after W p and W p_dot: to the first moment, at ports, to rows of W
template <class T> FFROBOT_NOINLINE void bend(const Body &b, State<T> &s) {
  const Stiffening &k = *b.stiffening;
  Bent<T> &bent = s.bent;
  bend_fields(b, s);
  for (int j = 0; j < b.n; ++j)
    for (int r = 0; r < b.width; ++r)
      bent.rows[j * b.width + r] = T(b.rows[r * padded(b.n) + j]);
  for (int r = lanes; r < lanes + static_cast<int>(k.at_ports.size()); ++r) {
    const auto second = curve(k.at_ports[r - lanes], b.n, s, bent.rows.data() + r, b.width);
    s.u[r] -= second.half, s.u_dot[r] -= second.rate;
    bent.curvature[r] = second.bending;
  }
  for (int c = 0; c < 3; ++c) {
    s.u[c] = k.root_mass * bent.all.g[c][0] - b.s0[c], s.u_dot[c] = k.root_mass * bent.all.g_dot[c][0];
    for (int j = 0; j < b.n; ++j)
      bent.rows[j * b.width + c] = k.root_mass * bent.F[c * k.fields * padded(b.n) + j];
  }
}

// `sign` times what affine fields have of J, of the rows of m_thetaf and of the forces of velocities on frame and
// modes; F by axis and field, of the linear body or F(p); y = w x (w x g) + 2 w x g_dot (- p_dot^T K p_dot)
template <class T, class X>
inline void add_affine(const Body &b, double sign, const X *F, const typename Bent<T>::Affine &affine,
                       const T (&y)[3][most_fields], State<T> &s, FrameTerms<T> &to) {
  const int fields = b.stiffening->fields, stride = padded(b.n);
  T *h = s.bent.rows.data() + Body::h, *Q_f = s.Q_f.data();
  for (int f = 0; f < fields; ++f) {
    const T g[3] = {sign * affine.g[0][f], sign * affine.g[1][f], sign * affine.g[2][f]};
    for (int c = 0; c < 3; ++c) {
      const int d = (c + 1) % 3, e = (c + 2) % 3; // c, d, e cyclic
      to.bias[3 + c] += g[d] * y[e][f] - g[e] * y[d][f];
      to.J[c] += g[d] * affine.g[d][f] + g[e] * affine.g[e][f];
      to.J[symmetric_index(c, d)] -= g[c] * affine.g[d][f];
      const X *row = F + (c * fields + f) * stride;
      const T force = sign * y[c][f];
      for (int k = 0; k < b.n; ++k) {
        Q_f[k] -= force * row[k];
        h[k * b.width + d] += g[e] * row[k], h[k * b.width + e] -= g[d] * row[k];
      }
    }
  }
}

// w x (w x g) + 2 w x g_dot, less `bending` where there is any
template <class T>
inline void field_accelerations(const T *w, const typename Bent<T>::Affine &affine, const T (*bending)[most_fields],
                                int fields, T (&y)[3][most_fields]) {
  for (int f = 0; f < fields; ++f) {
    const T g[3] = {affine.g[0][f], affine.g[1][f], affine.g[2][f]};
    const T g_dot[3] = {affine.g_dot[0][f], affine.g_dot[1][f], affine.g_dot[2][f]};
    T wg[3], wwg[3], wg_dot[3];
    cross(w, g, wg), cross(w, wg, wwg), cross(w, g_dot, wg_dot);
    for (int c = 0; c < 3; ++c)
      y[c][f] = bending ? wwg[c] + 2. * wg_dot[c] - bending[c][f] : wwg[c] + 2. * wg_dot[c];
  }
}

// m_ff = 1 - F^T F + F(p)^T F(p), by the rows of F that change, products of rows, and what rows accelerate by
template <class T> inline void eliminate_modes(const Body &b, State<T> &s) {
  const Stiffening &k = *b.stiffening;
  Bent<T> &bent = s.bent;
  const int stride = padded(b.n), n = b.n;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j <= i; ++j)
      bent.factor[i * n + j] = T(k.m_ff_rest[i * stride + j]);
  for (int r = 0; r < 3 * k.fields; ++r)
    if (k.K[r].kind != ModeMatrix::Kind::zero) {
      const T *F = bent.F.data() + r * stride;
      for (int i = 0; i < n; ++i)
        for (int j = 0; j <= i; ++j)
          bent.factor[i * n + j] += F[i] * F[j];
    }
  for (int i = 0; i < n; ++i)
    bent.rows[i * b.width + bent.FORCE] = s.Q_f[i];
  bent.eliminate();
  bent.multiply(bent.gram.data());
  for (int r = 0; r < b.width; ++r) { // rows of gram go through registers with zeros behind their six numbers
    T &by_force = bent.gram[r * b.width + bent.FORCE];
    s.Q[r] = by_force - bent.curvature[r], by_force = T(0.);
  }
}

// M_rr - m m_ff^-1 m^T and -(Q_r - m m_ff^-1 Q_f), after `stretch` and `twist`, whose terms are in to.J, Q_f, h_change,
// h_rate and Fw (twice the rate of J by modes, times w)
template <class T> FFROBOT_NOINLINE void bent_inertia(const Body &b, State<T> &s, const T *Fw, FrameTerms<T> &to) {
  Bent<T> &bent = s.bent;
  const T *w = s.omega;
  const int fields = b.stiffening->fields;
  T *h = bent.rows.data() + Body::h;
  int change = 0;
  for (const Twist &of : b.twists) {
    const T *h_c = s.h_change[change++].data();
    for (int c = 0; c < 3; ++c)
      for (int k = 0; k < b.n; ++k)
        h[k * b.width + c] += of.axis[3 + c] * h_c[k];
  }
  T spin[3];
  symmetric_turn(to.J, w, spin);
  for (int i = 0; i < 3; ++i)
    spin[i] += s.h_rate[i];
  cross(w, spin, to.bias + 3);
  for (int i = 0; i < 3; ++i)
    to.bias[3 + i] += Fw[i];

  T y[3][most_fields];
  field_accelerations<T>(w, bent.linear, nullptr, fields, y);
  add_affine(b, -1., b.stiffening->F.data(), bent.linear, y, s, to);
  field_accelerations<T>(w, bent.all, bent.bending, fields, y);
  add_affine(b, 1., static_cast<const T *>(bent.F.data()), bent.all, y, s, to);
  for (int i = 0; i < 3; ++i) {
    to.bias[i] = b.stiffening->root_mass * y[i][0], s.h_rate[i] = T(0.);
    for (int k = 0; k < b.n; ++k)
      s.h_rate[i] += h[k * b.width + i] * s.v[k];
  }
  eliminate_modes(b, s);

  for (int i = 0; i < 3; ++i) { // s~_kj = s_i
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    auto row = Pack<T, 6>::zero();
    row.set(i, T(b.mass)), row.set(3 + j, s.s[k]), row.set(3 + k, -s.s[j]); // m, -s~
    to.M[i] = row - Pack<T, 6>::read(bent.gram.data() + i * b.width);
    row = Pack<T, 6>::zero();
    row.set(j, -s.s[k]), row.set(k, s.s[j]);
    for (int l = 0; l < 3; ++l)
      row.set(3 + l, to.J[symmetric_index(i, l)]);
    to.M[3 + i] = row - Pack<T, 6>::read(bent.gram.data() + (3 + i) * b.width);
  }
  for (int i = 0; i < 6; ++i)
    to.bias[i] += s.Q[i];
}

// What m_ff has beyond 1, in 1/2 p_dot^T m_ff p_dot
inline double bending_energy(const Body &b, const State<double> &s) {
  double sum = 0;
  for (int c = 0; c < 3; ++c)
    for (int f = 0; f < b.stiffening->fields; ++f) {
      const double all = s.bent.all.g_dot[c][f], linear = s.bent.linear.g_dot[c][f];
      sum += 0.5 * (all * all - linear * linear);
    }
  return sum;
}

} // namespace ffrobot::recursion::spatial
