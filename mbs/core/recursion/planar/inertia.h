// The inertia of a planar body with its modes eliminated, the forces on it, and its modes by what acts on them.
#pragma once

#include "core/recursion/planar/stiffened.h"

namespace ffrobot::recursion::planar {

// Forces that the common case has not, in `more`, with J beyond J + p.p and its rate in s.p_p, s.p_v; change of row h
template <class T> void modal_forces(const Body &b, const T *p, const T *v, State<T> &s) {
  const T w = s.omega, ww = w * w;
  const int n = b.n;
  for (int i = 0; i < n; ++i)
    s.more[i] = T(0.), s.h[i] = T(0.);
  if (b.m_xy.size()) {
    s.p_p = s.p_v = T(0.);
    for (int i = 0; i < n; ++i) {
      T x(0.);
      for (int k = 0; k < n; ++k)
        x += b.m_xy(k, i) * p[k];
      s.more[i] += ww * (x - p[i]);
      s.p_p += x * p[i], s.p_v += x * v[i];
    }
  }
  for (int i = 0; i < b.j.size(); ++i) {
    s.more[i] += b.j[i] * ww;
    s.p_p += (2 * b.j[i]) * p[i], s.p_v += b.j[i] * v[i];
  }
  if (b.S_tilde.size())
    for (int i = 0; i < n; ++i)
      for (int k = 0; k < n; ++k) {
        s.more[i] += (2 * b.S_tilde(i, k)) * (w * v[k]);
        s.h[i] += b.S_tilde(k, i) * p[k];
      }
  if (b.D_full.size())
    for (int i = 0; i < n; ++i)
      for (int k = 0; k < n; ++k)
        s.more[i] -= b.D_full(i, k) * v[k];
}

// … and what they are to rows of W
template <class T> void more_forces(const Body &b, const T *p, const T *v, State<T> &s) {
  modal_forces(b, p, v, s);
  const T ww = s.omega * s.omega;
  const int n = b.n;
  for (int r = 0; r < b.width(); ++r) {
    T Q(0.), WH(0.);
    for (int i = 0; i < n; ++i) {
      const double W = b.columns[i * b.width() + r];
      Q += W * s.more[i], WH += W * s.h[i];
    }
    s.Q[r] += Q, s.WH[r] = WH;
  }
  for (int i = 0; i < n; ++i)
    s.Q[Body::H] += s.h[i] * (ww * p[i] - s.elastic[i] + s.more[i]);
}

// W Q_f, in s.Q, and all that the common case has not
template <bool is_one_block = false, class T>
FFROBOT_INLINE void forces_on_rows(const Body &b, const T *p, const T *v, State<T> &s) {
  const T ww = s.omega * s.omega;
  const int width = is_one_block ? 8 : b.width();
  if constexpr (std::is_same_v<T, double>)
    for (int r = 0; r < width; r += 8)
      (ww * Eight::load(s.u.data() + r) - Eight::load(s.Q.data() + r)).store(s.Q.data() + r);
  else
    for (int r = 0; r < width; ++r)
      s.Q[r] = ww * s.u[r] - s.Q[r];
  if (!b.has_more)
    return;
  if (b.stiffening) {
    modal_forces(b, p, v, s);
    s.bent.inertia = bent_inertia(b, p, v, s);
  } else
    more_forces(b, p, v, s);
}

// M_rr - m m^T and -(Q_r - m Q_f), after that
template <class T> FFROBOT_INLINE Inertia<T> inertia(const Body &b, const State<T> &s) {
  if (b.has_more && b.stiffening)
    return s.bent.inertia;
  Inertia<T> M;
  const T ww = s.omega * s.omega, w2 = 2. * s.omega;
  const T *u = s.u.data(), *Q = s.Q.data();
  T p_p = s.p_p;
  M.xa = b.residual[0][2] - u[Body::Sy], M.ya = b.residual[1][2] + u[Body::Sx];
  if (b.has_more) {
    p_p -= 2. * s.WH[Body::H];
    for (int i = 0; i < b.n; ++i)
      p_p -= s.h[i] * s.h[i];
    M.xa -= s.WH[Body::Sx], M.ya -= s.WH[Body::Sy];
  }
  const T sx = b.sx + u[Body::Sx], sy = b.sy + u[Body::Sy];
  M.bx = Q[Body::Sx] - (ww * sx + w2 * s.u_dot[Body::Sy]), M.by = Q[Body::Sy] - (ww * sy - w2 * s.u_dot[Body::Sx]);
  M.ba = Q[Body::H] + w2 * s.p_v;
  M.xx = T(b.residual[0][0]), M.xy = T(b.residual[0][1]), M.yy = T(b.residual[1][1]);
  M.aa = b.residual[2][2] + p_p;
  return M;
}

// p_ddot = Q_f - m^T A + sum of P^T f, by multipliers without Q_f; z holds, by rows of W, -A and forces on ports, zeros
// elsewhere (and becomes another with geometric stiffening)
template <bool by_multipliers, class T>
FFROBOT_INLINE void modal_accelerations(const Body &b, const T *p, T *z, State<T> &s, T *a) {
  if (b.has_more && b.stiffening)
    return s.bent.accelerate(z, by_multipliers, a);
  const T ww = s.omega * s.omega, *elastic = s.elastic.data();
  const long stride = b.padded, last = b.width() - 2;
  in_registers<T>(b.n, [&]<int w>(long i) {
    using Part = Pack<T, w>;
    const double *row = b.rows.data() + i;
    Part sum = Part::zero(), sum2 = sum;
    if (!by_multipliers)
      sum = ww * Part::read(p + i) - Part::read(elastic + i);
    for (long r = 0; r <= last; r += 2, row += 2 * stride)
      add_scaled(z[r], row, sum), add_scaled(z[r + 1], row + stride, sum2);
    if (b.has_more) {
      sum += z[2] * Part::read(s.h.data() + i);
      if (!by_multipliers)
        sum += Part::read(s.more.data() + i);
    }
    (sum + sum2).write(a + i);
  });
}

// The same of a body with one block (pin_joints.h)
template <bool by_multipliers, class T>
FFROBOT_NOINLINE void modes_of_pin(const Body &b, const T *p, T *z, State<T> &s, T *a) {
  if constexpr (std::is_same_v<T, double>)
    if (!b.has_more) {
      const double ww = s.omega * s.omega, *elastic = s.elastic.data(), *tiles = b.tiles.data();
      return in_registers(b.n, [&]<int w>(long i) {
        using Part = Pack<double, w>;
        const long first = i & -native_lanes; // of the tile
        const auto row = [&](int r) { return Part::read(tiles + 8 * first + r * native_lanes + (i - first)); };
        Part sum = z[3] * row(3), sum2 = z[4] * row(4); // what is known last, z[2], comes last
        if (!by_multipliers)
          sum += ww * Part::read(p + i) - Part::read(elastic + i);
        sum += z[Body::TILT] * row(Body::TILT) + z[0] * row(0);
        sum2 += z[5] * row(5) + z[1] * row(1);
        sum2 += z[2] * row(2);
        (sum + sum2).write(a + i);
      });
    }
  modal_accelerations<by_multipliers>(b, p, z, s, a);
}

} // namespace ffrobot::recursion::planar
