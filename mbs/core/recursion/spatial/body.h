// A spatial flexible body as the recursion needs it. A = (a; alpha): acceleration of the origin, less gravity, and
// angular acceleration, both in body axes.
//
// With u = x + S p, everything of the inertia that moves follows from B^ab = integral of u_a S_b dm = I_bar_ab + D^ab
// p, D^ab = S_bar_ab: J, m_thetaf, centrifugal and Coriolis forces (formulation of a spatial body, sections 2 and 3).
// Blocks D^ab that vanish are left out, sparse ones (beams: modes meet in pairs) are lists: O(n) for beams, O(n^2) for
// solids.
//
// Rows of W lie side by side: S_bar, m_thetaf, Phi of port 0 (6), the change of m_thetaf with p, a zero; then Phi of
// each further port and two zeros. Phi is along the axes of the undeformed section.
#pragma once

#include "core/recursion/model.h"
#include "core/recursion/register.h"
#include "core/recursion/small.h"

namespace ffrobot::recursion::spatial {

using Matrix = double[3][3];

struct Port {
  double r[3] = {};     // undeformed, body axes
  Matrix R = {};        // its axes, undeformed: columns
  int row = 6;          // its first in W
  double T[6][6] = {};  // X - P m^T of the undeformed body
  bool is_soft = false; // some row of Phi is not zero
};

struct Entry {
  int row, column;
  double value;
};

struct Body {
  static constexpr int S = 0, h = 3, dh = 12;
  Body() = default;
  Body(const SpatialData &data, const std::vector<int> &used);

  int n = 0, width = 16;
  double mass = 0, s0[3] = {};
  Matrix E0 = {}, J0 = {};    // integral of x x^T; inertia with that of spin
  double residual[6][6] = {}; // M_rr - m m^T of the undeformed body
  Aligned<double> W;          // (n, width) transposed, m_thetaf of the undeformed body
  Aligned<double> G;          // (width, width) W W^T
  Aligned<double> K, D;       // (n) stiffness; damping where it is diagonal
  bool is_damped = false;
  Eigen::MatrixXd D_full; // damping where it is not diagonal
  std::vector<Port> ports;

  // I_bar_ab (9, n) and where D^ab is: stacked dense blocks, then sparse ones; -1: vanishes.
  Aligned<double> I_bar;
  bool has_I_bar[9] = {};
  int block[9] = {-1, -1, -1, -1, -1, -1, -1, -1, -1};
  int dense_blocks = 0, stacked = 0; // rows of the stack, padded to 8
  Aligned<double> dense;             // (n, stacked)
  std::vector<Entry> sparse;         // row: in the stack of all blocks
  int blocks = 0;                    // all that do not vanish
  bool h_moves = false;              // m_thetaf does

  int row_count() const { return width; }
  double gram(int r, int c) const { return G[static_cast<std::size_t>(r * width + c)]; }

private:
  void book_blocks(const SpatialData &data, const Eigen::MatrixXd &I);
};

// The same body with its frame at `position`, its axes the columns of `triad`.
SpatialData moved(const SpatialData &data, const Eigen::Vector3d &position, const Eigen::Matrix3d &triad);

// A port and the section there
template <class T> struct PortMotion {
  T r[3];               // body axes, deformed
  T phi[3], phi_dot[3]; // rotation vector of the section and its rate, undeformed axes
  T turn[3][3];         // exp(phi)
  T excess[3][3];       // J_l(phi) - I
};

template <class T> struct State {
  explicit State(const Body &b)
      : u(b.width, T(0.)), u_dot(u), W(b.W.begin(), b.W.end()), change(b.blocks * b.n + 8, T(0.)), rate(change),
        Q_f(b.n + 8, T(0.)), Q(b.width, T(0.)), Wdh{Q, Q, Q}, ports(b.ports.size()) {
    for (auto &row : M)
      row = Pack<T, 6>::zero(); // lanes beyond 6 are summed up, too
  }

  T absolute[3][3];        // body axes to global ones
  T omega[3];              // body axes
  T A[6];                  // of the last evaluation
  T s[3], J[3][3];         // first moment, inertia
  Pack<T, 6> M[6];         // M_rr - m m^T
  T b[6];                  // -(Q_r - m Q_f)
  Aligned<T> u, u_dot;     // W p, W p_dot but for m_thetaf
  Aligned<T> W;            // (n, width) at p
  Aligned<T> change, rate; // D p, D p_dot by blocks
  Aligned<T> Q_f, Q;       // modal forces (applied ones first), W Q_f
  Aligned<T> Wdh[3];       // W times the change of m_thetaf
  std::vector<PortMotion<T>> ports;
};

constexpr int series_terms = 9; // of the sums below: 1e-16 at 1.3 rad, 1e-13 at 2 rad, 4e-10 at half a turn

// 1/(2 k + m)! with alternating signs, k = 0, 1, …
template <int m> constexpr std::array<double, series_terms> alternating_factorials() {
  std::array<double, series_terms> c{};
  double factorial = 1;
  for (int i = 2; i <= m; ++i)
    factorial *= i;
  for (int k = 0; k < series_terms; ++k) {
    c[k] = (k % 2 ? -1 : 1) / factorial;
    factorial *= (2. * k + m + 1) * (2. * k + m + 2);
  }
  return c;
}

// The sum of c_k y^k and its derivative
template <class T>
FFROBOT_INLINE void power_series(const std::array<double, series_terms> &c, const T &y, T &sum, T &slope) {
  sum = T(c[series_terms - 1]), slope = T(0.);
#pragma GCC unroll 8
  for (int k = series_terms - 2; k >= 0; --k)
    slope = slope * y + sum, sum = sum * y + c[k];
}

// (1 - cos)/x^2, (x - sin)/x^3 and their derivatives by y = x^2
template <class T> inline void rotation_series(const T &y, T &a, T &b, T &a_rate, T &b_rate) {
  constexpr auto of_a = alternating_factorials<2>(), of_b = alternating_factorials<3>();
  power_series(of_a, y, a, a_rate), power_series(of_b, y, b, b_rate);
}

// exp(phi) = I + (1 - y b) phi~ + a phi~^2, J_l = I + a phi~ + b phi~^2, y = |phi|^2
template <class T> inline void turn_section(PortMotion<T> &m) {
  const T *f = m.phi, y = dot(f, f);
  T a, b, a_rate, b_rate;
  rotation_series(y, a, b, a_rate, b_rate);
  const T sinc = 1. - y * b;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      const T square = i == j ? f[i] * f[j] - y : f[i] * f[j];
      m.excess[i][j] = b * square;
      m.turn[i][j] = i == j ? a * square + 1. : a * square;
    }
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3; // phi~_kj = phi_i
    m.excess[k][j] += a * f[i], m.excess[j][k] -= a * f[i];
    m.turn[k][j] += sinc * f[i], m.turn[j][k] -= sinc * f[i];
  }
}

// J_l phi_dot, the angular velocity of the section against the body, undeformed axes
template <class T> FFROBOT_INLINE void section_rate(const PortMotion<T> &m, T *out) {
  turn(m.excess, m.phi_dot, out);
  for (int i = 0; i < 3; ++i)
    out[i] += m.phi_dot[i];
}

// (d/dt J_l) phi_dot
template <class T> inline void jacobian_rate(const PortMotion<T> &m, T *out) {
  const T *f = m.phi, *d = m.phi_dot;
  T a, b, a_rate, b_rate, fd[3], ffd[3], dfd[3];
  rotation_series(dot(f, f), a, b, a_rate, b_rate);
  const T y_dot = 2. * dot(f, d);
  cross(f, d, fd), cross(f, fd, ffd), cross(d, fd, dfd);
  for (int i = 0; i < 3; ++i)
    out[i] = a_rate * y_dot * fd[i] + b_rate * y_dot * ffd[i] + b * dfd[i];
}

template <class T> inline void project(const Body &b, const T *p, const T *v, const T *force, State<T> &s) {
  if (b.n == 0)
    return;
  for (int block = 0; block < b.width; block += 8) {
    Pack<T, 8> u = Pack<T, 8>::zero(), u_dot = u;
    const T *row = s.W.data() + block;
    for (int k = 0; k < b.n; ++k, row += b.width) {
      const auto w = Pack<T, 8>::read(row);
      u += p[k] * w, u_dot += v[k] * w;
    }
    u.write(s.u.data() + block), u_dot.write(s.u_dot.data() + block);
  }
  for (int k = 0; k < b.n; ++k)
    s.Q_f[k] = -(b.K[k] * p[k]);
  if (force)
    for (int k = 0; k < b.n; ++k)
      s.Q_f[k] += force[k];
  if (b.is_damped)
    for (int k = 0; k < b.n; ++k)
      s.Q_f[k] -= b.D[k] * v[k];
  for (Eigen::Index k = 0; k < b.D_full.rows(); ++k)
    for (Eigen::Index j = 0; j < b.n; ++j)
      s.Q_f[k] -= b.D_full(k, j) * v[j];
  for (std::size_t i = 0; i < b.ports.size(); ++i)
    if (b.ports[i].is_soft) {
      PortMotion<T> &m = s.ports[i];
      const int row = b.ports[i].row + 3;
      for (int k = 0; k < 3; ++k)
        m.phi[k] = s.u[row + k], m.phi_dot[k] = s.u_dot[row + k];
      turn_section(m);
    }
}

// D p and D p_dot
template <class T> inline void move_blocks(const Body &b, const T *p, const T *v, State<T> &s) {
  const int n = b.n;
  T *x = s.change.data(), *y = s.rate.data();
  for (int i = 0; i < b.stacked; i += 8) {
    Pack<T, 8> X = Pack<T, 8>::zero(), Y = X;
    const double *D = b.dense.data() + i;
    for (int k = 0; k < n; ++k, D += b.stacked)
      if constexpr (std::is_same_v<T, double>) {
        const auto row = Pack<T, 8>::read(D);
        X += p[k] * row, Y += v[k] * row;
      } else
        for (int l = 0; l < 8; ++l)
          X.x[l] += D[l] * p[k], Y.x[l] += D[l] * v[k];
    X.write(x + i), Y.write(y + i);
  }
  for (int i = b.dense_blocks * n; i < b.blocks * n; ++i)
    x[i] = y[i] = T(0.);
  for (const Entry &e : b.sparse)
    x[e.row] += e.value * p[e.column], y[e.row] += e.value * v[e.column];
}

// M_rr - m m^T and -(Q_r - m Q_f)
template <class T> inline void inertia(const Body &b, const T *p, const T *v, State<T> &s) {
  const int n = b.n, width = b.width;
  const T *w = s.omega;
  const T ww = dot(w, w);
  T Om[3][3], E[3][3], F[3][3]; // -w~ w~; change of the integral of u u^T; integral of u v^T
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      Om[i][j] = i == j ? ww - w[i] * w[j] : -(w[i] * w[j]), E[i][j] = F[i][j] = T(0.);
  for (int i = 0; i < 3; ++i)
    s.s[i] = T(b.s0[i]);
  if (n) {
    move_blocks(b, p, v, s);
    const T W2[3][3] = {{T(0.), -2. * w[2], 2. * w[1]}, {2. * w[2], T(0.), -2. * w[0]}, {-2. * w[1], 2. * w[0], T(0.)}};
    T *Q_f = s.Q_f.data();
    for (int a = 0; a < 3; ++a)
      for (int c = 0; c < 3; ++c) {
        const int slot = 3 * a + c;
        const double *I = b.I_bar.data() + slot * n;
        if (b.has_I_bar[slot]) {
          T Ip(0.), Iv(0.);
          for (int k = 0; k < n; ++k)
            Ip += I[k] * p[k], Iv += I[k] * v[k], Q_f[k] += I[k] * Om[a][c];
          E[a][c] += Ip, E[c][a] += Ip, F[a][c] += Iv;
        }
        if (b.block[slot] >= 0) {
          const T *x = s.change.data() + b.block[slot] * n, *y = s.rate.data() + b.block[slot] * n;
          T xp(0.), xv(0.);
          for (int k = 0; k < n; ++k) {
            xp += x[k] * p[k], xv += x[k] * v[k];
            Q_f[k] += Om[a][c] * x[k] + W2[a][c] * y[k];
          }
          E[a][c] += xp, F[a][c] += xv;
        }
      }
    if (b.h_moves) {
      const auto block = [&](int slot) { return b.block[slot] < 0 ? nullptr : s.change.data() + b.block[slot] * n; };
      constexpr int plus[3] = {5, 6, 1}, minus[3] = {7, 2, 3}; // u_y S_z - u_z S_y and so on
      for (int c = 0; c < 3; ++c) {
        const T *x = block(plus[c]), *y = block(minus[c]);
        if (!x && !y)
          continue;
        for (int k = 0; k < n; ++k) {
          T change(0.);
          if (x)
            change += x[k];
          if (y)
            change -= y[k];
          s.W[k * width + Body::dh + c] = change;
          s.W[k * width + Body::h + c] = b.W[k * width + Body::h + c] + change;
        }
      }
    }
    for (int r = 0; r < width; r += 8) {
      Pack<T, 8> q = Pack<T, 8>::zero(), g[3] = {q, q, q};
      const T *row = s.W.data();
      for (int k = 0; k < n; ++k, row += width) {
        const auto x = Pack<T, 8>::read(row + r);
        q += Q_f[k] * x;
        if (b.h_moves)
          for (int c = 0; c < 3; ++c)
            g[c] += row[Body::dh + c] * x;
      }
      q.write(s.Q.data() + r);
      for (int c = 0; c < 3; ++c)
        g[c].write(s.Wdh[c].data() + r);
    }
    for (int i = 0; i < 3; ++i)
      s.s[i] += s.u[i];
  }
  const T trace = E[0][0] + E[1][1] + E[2][2];
  T M[6][6];
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      const T dJ = i == j ? trace - E[i][j] : -E[i][j];
      s.J[i][j] = b.J0[i][j] + dJ;
      M[i][j] = T(b.residual[i][j]);
      M[3 + i][3 + j] = b.residual[3 + i][3 + j] + dJ;
      M[3 + i][j] = T(b.residual[3 + i][j]);
    }
  if (n) {
    const T *u = s.u.data(); // s~ grows by (S p)~
    M[3][1] -= u[2], M[3][2] += u[1], M[4][0] += u[2], M[4][2] -= u[0], M[5][0] -= u[1], M[5][1] += u[0];
    if (b.h_moves)
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) {
          M[3 + i][j] -= s.Wdh[i][j];
          M[3 + i][3 + j] -= s.Wdh[i][Body::h + j] + s.Wdh[j][Body::h + i] - s.Wdh[i][Body::dh + j];
        }
  }
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j)
      s.M[i].set(j, i < 3 && j >= 3 ? M[j][i] : M[i][j]);
  T Jw[3], wJw[3], wS[3] = {T(0.), T(0.), T(0.)}, Fw[3];
  turn(s.J, w, Jw), cross(w, Jw, wJw), turn_back(F, w, Fw);
  if (n)
    cross(w, s.u_dot.data(), wS);
  const T F_trace = F[0][0] + F[1][1] + F[2][2];
  for (int i = 0; i < 3; ++i) {
    s.b[i] = 2. * wS[i] - (Om[i][0] * s.s[0] + Om[i][1] * s.s[1] + Om[i][2] * s.s[2]);
    s.b[3 + i] = wJw[i] + 2. * (F_trace * w[i] - Fw[i]);
    if (n)
      s.b[i] += s.Q[i], s.b[3 + i] += s.Q[3 + i];
  }
}

// Where the port is
template <class T> FFROBOT_INLINE void place_port(const Body &b, int i, State<T> &s) {
  const Port &port = b.ports[i];
  for (int k = 0; k < 3; ++k) {
    s.ports[i].r[k] = T(port.r[k]);
    if (port.is_soft)
      for (int l = 0; l < 3; ++l)
        s.ports[i].r[k] += port.R[k][l] * s.u[port.row + l];
  }
}

// A_port = T A + beta + G f of a port, in axes of the undeformed section; f: force and moment on it
template <class T>
FFROBOT_APART void port_rows(const Body &b, int i, State<T> &s, Pack<T, 6> *T_rows, T *beta, Pack<T, 6> *G) {
  const Port &port = b.ports[i];
  const PortMotion<T> &m = s.ports[i];
  const T *w = s.omega;
  T wr[3], wwr[3], t[6][6];
  cross(w, m.r, wr), cross(w, wr, wwr);
  for (int r = 0; r < 6; ++r)
    for (int c = 0; c < 6; ++c)
      t[r][c] = T(port.T[r][c]);
  if (!port.is_soft) {
    turn_back(port.R, wwr, beta);
    for (int k = 0; k < 3; ++k)
      beta[3 + k] = T(0.);
  } else {
    T du[3], wdu[3], moved[3], wp[3], rate[3], bias[3], dJ[3];
    turn(port.R, s.u_dot.data() + port.row, du), cross(w, du, wdu);
    for (int k = 0; k < 3; ++k)
      wwr[k] += 2. * wdu[k];
    turn_back(port.R, wwr, beta);
    turn_back(port.R, w, wp), section_rate(m, rate), cross(wp, rate, bias), jacobian_rate(m, dJ);
    const T *Q = s.Q.data() + port.row;
    turn(m.excess, Q + 3, moved);
    for (int k = 0; k < 3; ++k)
      beta[k] += Q[k], beta[3 + k] = Q[3 + k] + moved[k] + bias[k] + dJ[k];
    T dr[3];
    for (int k = 0; k < 3; ++k)
      dr[k] = m.r[k] - port.r[k];
    for (int k = 0; k < 3; ++k) { // e_k . (alpha x dr) = alpha . (dr x e_k)
      const double e[3] = {port.R[0][k], port.R[1][k], port.R[2][k]};
      T turned[3];
      cross(dr, e, turned);
      for (int c = 0; c < 3; ++c)
        t[k][3 + c] += turned[c];
    }
    T P[6][6]; // Phi m^T
    for (int r = 0; r < 6; ++r)
      for (int c = 0; c < 6; ++c)
        P[r][c] = T(b.gram(port.row + r, c));
    if (b.h_moves)
      for (int r = 0; r < 6; ++r)
        for (int c = 0; c < 3; ++c)
          P[r][3 + c] += s.Wdh[c][port.row + r], t[r][3 + c] -= s.Wdh[c][port.row + r];
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 6; ++c)
        t[3 + r][c] -= m.excess[r][0] * P[3][c] + m.excess[r][1] * P[4][c] + m.excess[r][2] * P[5][c];
    port_gram(b, s, i, i, G);
  }
  for (int r = 0; r < 6; ++r)
    for (int c = 0; c < 6; ++c)
      T_rows[r].set(c, t[r][c]);
}

// G of forces on port j by accelerations of port i: H_i Phi_i Phi_j^T H_j^T, H = diag(I, J_l)
template <class T> FFROBOT_APART void port_gram(const Body &b, const State<T> &s, int i, int j, Pack<T, 6> *G) {
  const auto &X = s.ports[i].excess, &Y = s.ports[j].excess;
  T g[6][6], left[3][6];
  for (int r = 0; r < 6; ++r)
    for (int c = 0; c < 6; ++c)
      g[r][c] = T(b.gram(b.ports[i].row + r, b.ports[j].row + c));
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 6; ++c)
      left[r][c] = X[r][0] * g[3][c] + X[r][1] * g[4][c] + X[r][2] * g[5][c];
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 6; ++c)
      g[3 + r][c] += left[r][c];
  for (int r = 0; r < 6; ++r) {
    T right[3];
    for (int c = 0; c < 3; ++c)
      right[c] = g[r][3] * Y[c][0] + g[r][4] * Y[c][1] + g[r][5] * Y[c][2];
    for (int c = 0; c < 3; ++c)
      g[r][3 + c] += right[c];
    for (int c = 0; c < 6; ++c)
      G[r].set(c, g[r][c]);
  }
}

// Puts the force and moment on a port into z, by rows of W
template <class T> FFROBOT_INLINE void put_force(const Body &b, const State<T> &s, int i, const T *f, T *z) {
  const Port &port = b.ports[i];
  if (!port.is_soft)
    return;
  T moment[3];
  turn_back(s.ports[i].excess, f + 3, moment);
  for (int k = 0; k < 3; ++k)
    z[port.row + k] = f[k], z[port.row + 3 + k] = f[3 + k] + moment[k];
}

// p_ddot = Q_f - m^T A + sum of P^T f, by multipliers without Q_f; z holds, by rows of W, -A and forces on ports, and
// zeros elsewhere
template <bool by_multipliers, class T>
inline void modal_accelerations(const Body &b, const T *z, const State<T> &s, T *a) {
  const T *row = s.W.data();
  for (int k = 0; k < b.n; ++k, row += b.width) {
    Pack<T, 8> sum = Pack<T, 8>::read(z) * Pack<T, 8>::read(row);
    for (int r = 8; r < b.width; r += 8)
      sum += Pack<T, 8>::read(z + r) * Pack<T, 8>::read(row + r);
    a[k] = by_multipliers ? sum.sum() : s.Q_f[k] + sum.sum();
  }
}

} // namespace ffrobot::recursion::spatial
