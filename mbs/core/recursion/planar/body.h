// A planar flexible body as the recursion needs it. A = (a_x, a_y, alpha): acceleration of the origin and of the frame,
// in body axes, less gravity.
//
// Everything that p_ddot = Q_f - m^T A + sum of P^T f meets are products with the rows
//     W = [S_bar_x; S_bar_y; h; Phi_x, Phi_y, Phi_rotation of port 0; of port 1; ...]
// and G = W W^T, both constant (but for h where S_tilde is not zero, and with stiffening: stiffened.h). They lie
// in blocks of eight: the frame's three and port 0, ports 1 and 2, ports 3 and 4 … Where modes turn the section of a
// pin (pin_joints.h), that rotation is row TILT of the first block; the row after it is zero (bent_modes.h: FORCE).
#pragma once

#include "core/recursion/planar/stiffening.h"
#include "core/recursion/spatial/bent_modes.h"

#include <memory>

namespace ffrobot::recursion::planar {

struct Port {
  double x = 0, y = 0, angle = 0; // undeformed, body axes
  int row = 3;                    // its first in W
  bool is_flexible = false;       // modes move it
  bool shifts = false;            // … along x or y
  bool turns = false;             // … and turn it
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
  Aligned<double> tiles; // of one block: (padded / native_lanes, 8, native_lanes) W by modes that go through a register
  Aligned<double> products; // G (8 blocks, 8 blocks); of ports X - P m^T, (x, y, rotation) by A, (ports, 3, 3)
  Aligned<double> K, D;     // (padded) stiffness; damping where it is diagonal
  bool is_damped = false;   // by a diagonal
  std::vector<Port> ports;
  // Where these are not empty, an evaluation takes the long way round: modal forces one by one.
  MatrixXd D_full, S_tilde, m_xy;
  VectorXd j;
  std::shared_ptr<const Stiffening> stiffening; // null without
  bool has_more = false;                        // any of these
  bool is_tilted = false;                       // has row TILT

  int width() const { return 8 * blocks; }
  int row_count() const { return width(); }
  const double *constant_rows() const { return columns.data(); } // transposed

private:
  void fill_rows(const PlanarData &data, const std::vector<int> &used, int tilted);
  void fill_layouts(const MatrixXd &W);
  void fill_products(const MatrixXd &W);
};

// The same body with its frame at `position`, turned by `angle`.
PlanarData moved(const PlanarData &data, const Vector2d &position, double angle);

template <class T> struct Inertia {
  T xx, xy, xa, yy, ya, aa; // M_rr - m m^T
  T bx, by, ba;             // -(Q_r - m Q_f)
};

// Of a body with geometric stiffening (stiffened.h); names as in stiffening.h
template <class T> struct Bent : BentModes<T> {
  using Fields = Pack<T, fields>;
  Bent(int n, int width) : BentModes<T>(n, width), p(padded(n), T(0.)), v(p), K_p(p), K_v(p), F(n * fields, T(0.)) {}

  struct Affine { // of the fields
    Fields g, g_dot;
  };
  Affine linear, all; // without and with terms of second order
  Fields bending;     // p_dot^T K p_dot
  Inertia<T> inertia;
  Aligned<T> p, v;     // padded
  Aligned<T> K_p, K_v; // one after the other
  Aligned<T> F;        // (n, 4) F(p) transposed
};

template <class T> struct State {
  explicit State(const Body &body)
      : u(body.width(), T(0.)), u_dot(u), Q(u), elastic(body.padded, T(0.)), more(body.padded, T(0.)),
        h(body.padded, T(0.)), WH(body.width(), T(0.)), products(body.products.begin(), body.products.end()),
        bent(body.stiffening ? body.n : 0, body.stiffening ? body.width() : 0) {}

  T cosine, sine;                   // of the frame against the inboard port
  T absolute_cosine, absolute_sine; // of the frame
  T omega;                          // of the frame
  T A[3];                           // of the last evaluation
  T on_modes = T(0.);               // moment along the coordinate of a pin, where modes turn its section
  T on_port = T(0.);                // the one that is given at its port
  T p_p, p_v;
  Aligned<T> u, u_dot, Q; // W p, W p_dot, W Q_f
  Aligned<T> elastic;     // (n) K p + D p_dot - applied modal forces
  Aligned<T> more, h, WH; // (n) other modal forces; change of row h; W times it
  Aligned<T> products;    // as of the body: constant without geometric stiffening
  Bent<T> bent;           // empty without

  const T &gram(const Body &b, int r, int c) const { return products[r * b.width() + c]; }
  const T *X(const Body &b, int port) const { return products.data() + b.width() * b.width() + 9 * port; }
  // The same of a body that has one block, as those between pins have
  const T &gram_of_block(int r, int c) const { return products[8 * r + c]; }
  const T &X_of_block(int r, int c) const { return products[64 + 3 * r + c]; }
};

// --- W p, W p_dot, W (K p + D p_dot - force), p.p, p.p_dot; force (n) may be null

template <class T> FFROBOT_INLINE void project(const Body &b, const T *p, const T *v, const T *force, State<T> &s) {
  const long n = b.n;
  auto pp = Pack<T, full_width<T>>::zero(), pv = pp;
  T pp_rest(0.), pv_rest(0.), *elastic = s.elastic.data();
  in_registers<T>(n, [&]<int w>(long i) {
    using Part = Pack<T, w>;
    const Part x = Part::read(p + i), y = Part::read(v + i);
    Part k = constant_row<w, T>(b.K.data() + i) * x;
    if (b.is_damped)
      k += constant_row<w, T>(b.D.data() + i) * y;
    if (force)
      k -= Part::read(force + i);
    k.write(elastic + i);
    if constexpr (w == full_width<T>)
      pp += x * x, pv += x * y;
    else
      pp_rest += (x * x).sum(), pv_rest += (x * y).sum();
  });
  s.p_p = pp.sum() + pp_rest, s.p_v = pv.sum() + pv_rest;
  const auto multiply = [&](long block, auto width) {
    auto u = Pack<T, 8>::zero(), u_dot = u, k = u;
    const double *column = b.columns.data() + block;
#pragma GCC unroll 2
    for (long i = 0; i < n; ++i, column += width)
      add_scaled(p[i], column, u), add_scaled(v[i], column, u_dot), add_scaled(elastic[i], column, k);
    u.write(s.u.data() + block), u_dot.write(s.u_dot.data() + block), k.write(s.Q.data() + block);
  };
  if (b.blocks == 1)
    return multiply(0, std::integral_constant<long, 8>());
  for (long block = 0; block < b.width(); block += 8)
    multiply(block, static_cast<long>(b.width()));
}

} // namespace ffrobot::recursion::planar
