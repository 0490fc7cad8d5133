// A planar flexible body as the recursion needs it. A = (a_x, a_y, alpha): acceleration of the origin and of the frame,
// in body axes, less gravity.
//
// Everything that p_ddot = Q_f - m^T A + sum of P^T f meets are products with the rows
//     W = [S_bar_x; S_bar_y; h; Phi_x, Phi_y, Phi_rotation of port 0; of port 1; ...]
// and G = W W^T, both constant (but for h where S_tilde is not zero). They lie in blocks of eight: the frame's three
// and port 0, ports 1 and 2, ports 3 and 4 … Where modes turn the section of a pin (pins.h), that rotation is row TILT
// of the first block.
#pragma once

#include "core/recursion/model.h"
#include "core/recursion/register.h"
#include "core/recursion/small.h"

namespace ffrobot::recursion::planar {

struct Port {
  double x = 0, y = 0, angle = 0; // undeformed, body axes
  int row = 3;                    // its first in W
  double T[3][3] = {};            // X - P m^T: (x, y, rotation) by A
  bool is_soft = false;           // some row of Phi is not zero
  bool turns = false;             // Phi_rotation is not zero
};

struct Body {
  enum { Sx, Sy, H, TILT = 6 };
  Body() = default;
  // `used`: markers of `data` that are ports; `tilted`: that of the section that the joint holds, -1 where the frame
  // turns with it
  Body(const PlanarData &data, const std::vector<int> &used, int tilted);

  int n = 0, blocks = 1, padded = 0;
  double mass = 0, sx = 0, sy = 0, J = 0;
  double residual[3][3] = {}; // M_rr - m m^T, constant part
  Aligned<double> columns;    // (n, 8 blocks) W transposed
  Aligned<double> rows;       // (8 blocks, padded) W
  Aligned<double> G;          // (8 blocks, 8 blocks)
  Aligned<double> K, D;       // (padded) stiffness; damping where it is diagonal
  bool is_damped = false;     // by a diagonal
  std::vector<Port> ports;
  // Where these are not empty, an evaluation takes the long way round: modal forces one by one.
  Eigen::MatrixXd D_full, S_tilde, m_xy;
  Eigen::VectorXd j;
  bool has_more = false;  // any of these
  bool is_tilted = false; // has row TILT

  int width() const { return 8 * blocks; }
  int row_count() const { return width(); }
  double gram(int r, int c) const { return G[static_cast<std::size_t>(r * width() + c)]; }
};

// The same body with its frame at `position`, turned by `angle`.
PlanarData moved(const PlanarData &data, const Eigen::Vector2d &position, double angle);

template <class T> struct Inertia {
  T xx, xy, xa, yy, ya, aa; // M_rr - m m^T
  T bx, by, ba;             // -(Q_r - m Q_f)
};

template <class T> struct State {
  explicit State(const Body &body)
      : u(body.width(), T(0.)), u_dot(u), Q(u), elastic(body.padded, T(0.)), more(body.padded, T(0.)),
        h(body.padded, T(0.)), WH(body.width(), T(0.)) {}

  T cosine, sine;                   // of the frame against the port it hangs on
  T absolute_cosine, absolute_sine; // of the frame
  T omega;                          // of the frame
  T A[3];                           // of the last evaluation
  T on_modes = T(0.);               // moment along the coordinate of a pin, where modes turn its section
  T p_p, p_v;
  Aligned<T> u, u_dot, Q; // W p, W p_dot, W Q_f
  Aligned<T> elastic;     // (n) K p + D p_dot - applied modal forces
  Aligned<T> more, h, WH; // (n) other modal forces; change of row h; W times it
};

// --- W p, W p_dot, W (K p + D p_dot - force), p.p, p.p_dot; force (n) may be null

FFROBOT_INLINE void project(const Body &b, const double *p, const double *v, const double *force, State<double> &s) {
  const int n = b.n, width = b.width();
  Eight pp = Eight::zero(), pv = Eight::zero();
  double *elastic = s.elastic.data();
  for (int i = 0; i < n; i += 8) {
    const Eight x = n - i >= 8 ? Eight::load(p + i) : load_part(p + i, n - i);
    const Eight y = n - i >= 8 ? Eight::load(v + i) : load_part(v + i, n - i);
    Eight k = Eight::load(b.K.data() + i) * x;
    if (b.is_damped)
      k += Eight::load(b.D.data() + i) * y;
    if (force)
      k -= n - i >= 8 ? Eight::load(force + i) : load_part(force + i, n - i);
    k.store(elastic + i);
    pp += x * x, pv += x * y;
  }
  s.p_p = pp.sum(), s.p_v = pv.sum();
  for (int block = 0; block < width; block += 8) {
    Eight u = Eight::zero(), u_dot = u, k = u, u2 = u, u_dot2 = u, k2 = u;
    const double *column = b.columns.data() + block;
    int i = 0;
    for (; i + 2 <= n; i += 2, column += 2 * width) {
      const Eight w = Eight::load(column), w2 = Eight::load(column + width);
      u += p[i] * w, u_dot += v[i] * w, k += elastic[i] * w;
      u2 += p[i + 1] * w2, u_dot2 += v[i + 1] * w2, k2 += elastic[i + 1] * w2;
    }
    if (i < n) {
      const Eight w = Eight::load(column);
      u += p[i] * w, u_dot += v[i] * w, k += elastic[i] * w;
    }
    (u + u2).store(s.u.data() + block), (u_dot + u_dot2).store(s.u_dot.data() + block);
    (k + k2).store(s.Q.data() + block);
  }
}

template <class T> inline void project(const Body &b, const T *p, const T *v, const T *force, State<T> &s) {
  const int width = b.width();
  s.p_p = s.p_v = T(0.);
  for (int r = 0; r < width; ++r)
    s.u[r] = s.u_dot[r] = s.Q[r] = T(0.);
  for (int i = 0; i < b.n; ++i) {
    T k = b.K[i] * p[i];
    if (b.is_damped)
      k += b.D[i] * v[i];
    if (force)
      k -= force[i];
    s.elastic[i] = k;
    s.p_p += p[i] * p[i], s.p_v += p[i] * v[i];
    for (int r = 0; r < width; ++r)
      if (const double w = b.columns[i * width + r]; w != 0)
        s.u[r] += w * p[i], s.u_dot[r] += w * v[i], s.Q[r] += w * k;
  }
}

// Forces that the common case has not, in `more`, with J beyond J + p.p and its rate in s.p_p, s.p_v; row h at p.
template <class T> void more_forces(const Body &b, const T *p, const T *v, State<T> &s) {
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

// M_rr - m m^T and -(Q_r - m Q_f)
template <class T> FFROBOT_INLINE Inertia<T> inertia(const Body &b, const T *p, const T *v, State<T> &s) {
  Inertia<T> M;
  const T ww = s.omega * s.omega, w2 = 2. * s.omega;
  const int width = b.width();
  if constexpr (std::is_same_v<T, double>)
    for (int r = 0; r < width; r += 8)
      (ww * Eight::load(s.u.data() + r) - Eight::load(s.Q.data() + r)).store(s.Q.data() + r);
  else
    for (int r = 0; r < width; ++r)
      s.Q[r] = ww * s.u[r] - s.Q[r];
  const T *u = s.u.data(), *Q = s.Q.data();
  T p_p = s.p_p;
  M.xa = b.residual[0][2] - u[Body::Sy], M.ya = b.residual[1][2] + u[Body::Sx];
  if (b.has_more) {
    more_forces(b, p, v, s);
    p_p = s.p_p - 2. * s.WH[Body::H];
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

// p_ddot = Q_f - m^T A + sum of P^T f, by multipliers without Q_f; z holds, by rows of W, -A and forces on ports
template <bool by_multipliers>
FFROBOT_INLINE void modal_accelerations(const Body &b, const double *p, const double *z, State<double> &s, double *a) {
  const double ww = s.omega * s.omega;
  const int n = b.n, stride = b.padded;
  for (int i = 0; i < n; i += 8) {
    const int left = n - i;
    const double *W = b.rows.data() + i;
    Eight sum = Eight::zero();
    if (!by_multipliers)
      sum = ww * (left >= 8 ? Eight::load(p + i) : load_part(p + i, left)) - Eight::load(s.elastic.data() + i);
    Eight sum2 = z[0] * Eight::load(W) + z[2] * Eight::load(W + 2 * stride);
    sum += z[1] * Eight::load(W + stride);
    for (const Port &port : b.ports)
      if (port.is_soft) {
        const int r = port.row;
        sum += z[r] * Eight::load(W + r * stride), sum2 += z[r + 1] * Eight::load(W + (r + 1) * stride);
        if (port.turns)
          sum += z[r + 2] * Eight::load(W + (r + 2) * stride);
      }
    if (b.is_tilted)
      sum += z[Body::TILT] * Eight::load(W + Body::TILT * stride);
    if (b.has_more) {
      sum += z[2] * Eight::load(s.h.data() + i);
      if (!by_multipliers)
        sum += Eight::load(s.more.data() + i);
    }
    sum += sum2;
    left >= 8 ? sum.store(a + i) : store_part(a + i, sum, left);
  }
}

template <bool by_multipliers, class T>
inline void modal_accelerations(const Body &b, const T *p, const T *z, State<T> &s, T *a) {
  const T ww = s.omega * s.omega;
  for (int i = 0; i < b.n; ++i) {
    T sum = by_multipliers ? T(0.) : T(ww * p[i] - s.elastic[i]);
    for (int r = 0; r < b.width(); ++r)
      if (const double w = b.columns[i * b.width() + r]; w != 0)
        sum += w * z[r];
    if (b.has_more)
      sum += by_multipliers ? s.h[i] * z[2] : s.more[i] + s.h[i] * z[2];
    a[i] = sum;
  }
}

} // namespace ffrobot::recursion::planar
