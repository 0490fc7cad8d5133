// Ports of a spatial body, and its modes by what acts on them.
#pragma once

#include "core/recursion/spatial/inertia.h"

namespace ffrobot::recursion::spatial {

// Where the port is
template <class T> FFROBOT_INLINE void place_port(const Body &b, int i, State<T> &s) {
  const Port &port = b.ports[i];
  for (int k = 0; k < 3; ++k) {
    s.ports[i].r[k] = T(port.r[k]);
    if (port.is_flexible)
      for (int l = 0; l < 3; ++l)
        s.ports[i].r[k] += port.R[k][l] * s.u[port.row + l];
  }
}

// What velocities do to the acceleration of the section, with Phi Q_f
template <class T> FFROBOT_INLINE void port_bias(const Body &b, int i, const State<T> &s, T *beta) {
  const Port &port = b.ports[i];
  const PortMotion<T> &m = s.ports[i];
  const T *w = s.omega;
  T wr[3], wwr[3];
  cross(w, m.r, wr), cross(w, wr, wwr);
  if (!port.is_flexible) {
    turn_back(port.R, wwr, beta);
    for (int k = 0; k < 3; ++k)
      beta[3 + k] = T(0.);
    return;
  }
  T du[3], wdu[3], moved[3], wp[3], bias[3];
  turn(port.R, s.u_dot.data() + port.row, du), cross(w, du, wdu);
  for (int k = 0; k < 3; ++k)
    wwr[k] += 2. * wdu[k];
  turn_back(port.R, wwr, beta), turn_back(port.R, w, wp), cross(wp, m.rate, bias);
  const T *Q = s.Q.data() + port.row;
  turn(m.excess, Q + 3, moved);
  for (int k = 0; k < 3; ++k)
    beta[k] += Q[k], beta[3 + k] = Q[3 + k] + moved[k] + bias[k] + m.drift[k];
}

// X = X_rigid - P m^T at p: P = H Phi, H = diag(1, J_l)
template <class T> FFROBOT_INLINE void port_by_frame(const Body &b, int i, const State<T> &s, Pack<T, 6> *X) {
  using Vector = Pack<T, 6>;
  const Port &port = b.ports[i];
  if (!port.is_flexible) {
    for (int r = 0; r < 6; ++r)
      X[r] = constant_row<6, T>(port.T[r]);
    return;
  }
  const std::size_t twists = b.twists.size();
  const Vector z = twists ? constant_row<6, T>(b.twists[0].axis) : Vector::zero(); // most bodies have one twist or none
  const T *Wh = s.Wh[0].data() + port.row;
  const auto change = [&](int r) { // what row r of Phi m^T has beside its constant part
    if (b.stiffening)
      return Vector::read(s.bent.gram.data() + (port.row + r) * b.width);
    Vector x = Wh[r] * z;
    for (std::size_t c = 1; c < twists; ++c)
      add_scaled(s.Wh[c][port.row + r], b.twists[c].axis, x);
    return x;
  };
  const T *du = s.u.data() + port.row;
  for (int i1 = 0; i1 < 3; ++i1) { // e_k . (alpha x R du) = alpha . R (du x e_k)
    const int i2 = (i1 + 1) % 3, i3 = (i1 + 2) % 3;
    Vector x = constant_row<6, T>(port.T[i1]) - change(i1);
    add_scaled(du[i3], port.turning[i2], x), add_scaled(T(-1.) * du[i2], port.turning[i3], x);
    X[i1] = x;
  }
  Vector P[3], left[3]; // Phi_r m^T; rows of X without J_l - 1
  for (int r = 0; r < 3; ++r) {
    const Vector moved = change(3 + r);
    left[r] = constant_row<6, T>(port.T[3 + r]) - moved;
    P[r] = b.stiffening ? moved : constant_row<6, T>(b.gram(port.row + 3 + r, 0)) + moved;
  }
  const auto &excess = s.ports[i].excess;
  for (int r = 0; r < 3; ++r)
    X[3 + r] = left[r] - (excess[r][0] * P[0] + excess[r][1] * P[1] + excess[r][2] * P[2]);
}

// G of forces on port j by accelerations of port i: H_i Phi_i Phi_j^T H_j^T
template <class T> FFROBOT_NOINLINE void port_gram(const Body &b, const State<T> &s, int i, int j, Pack<T, 6> *G) {
  const auto &L = s.ports[i].excess;
  Pack<T, 6> rows[3], left[3]; // rows of H_j^T - 1
  for (int k = 0; k < 3; ++k)
    rows[k] = Pack<T, 6>::read(s.ports[j].columns[k]);
  for (int r = 0; r < 6; ++r)
    G[r] = b.stiffening ? Pack<T, 6>::read(s.bent.gram.data() + (b.ports[i].row + r) * b.width + b.ports[j].row)
                        : constant_row<6, T>(b.gram(b.ports[i].row + r, b.ports[j].row));
  for (int r = 0; r < 3; ++r)
    left[r] = L[r][0] * G[3] + L[r][1] * G[4] + L[r][2] * G[5];
  for (int r = 0; r < 3; ++r)
    G[3 + r] += left[r];
  for (int r = 0; r < 6; ++r)
    G[r] += G[r][3] * rows[0] + G[r][4] * rows[1] + G[r][5] * rows[2];
}

// A_port = X A + beta + G f of a port, in axes of the undeformed section; f: force and moment on it
template <class T>
FFROBOT_NOINLINE void port_rows(const Body &b, int i, State<T> &s, Pack<T, 6> *X, T *beta, Pack<T, 6> *G) {
  port_bias(b, i, s, beta);
  port_by_frame(b, i, s, X);
  if (b.ports[i].is_flexible)
    port_gram(b, s, i, i, G);
}

// Puts the force and moment on a port into z, by rows of W
template <class T> FFROBOT_INLINE void put_force(const Body &b, const State<T> &s, int i, const T *f, T *z) {
  const Port &port = b.ports[i];
  if (!port.is_flexible)
    return;
  T moment[3];
  turn_back(s.ports[i].excess, f + 3, moment);
  for (int k = 0; k < 3; ++k)
    z[port.row + k] = f[k], z[port.row + 3 + k] = f[3 + k] + moment[k];
}

// p_ddot of `blocks` registers of modes from the k-th on; `along`: z by twists
template <int blocks, bool by_multipliers, class T>
FFROBOT_INLINE void accelerate(const Body &b, int stride, const T *z, const T *along, const State<T> &s, int k, T *a) {
  const int width = b.width;
  const double *row = b.rows.data() + k;
  Modes<T> sum[blocks];
  for (int i = 0; i < blocks; ++i)
    sum[i] = by_multipliers ? Modes<T>::zero() : Modes<T>::read(s.Q_f.data() + k + i * step<T>);
  for (int first = 0; first < width; first += lanes, row += 2 * stride)
    for (int r = 0; r < 6; ++r, row += stride)
      for (int i = 0; i < blocks; ++i)
        add_scaled(z[first + r], row + i * step<T>, sum[i]);
  for (std::size_t c = 0; c < b.twists.size(); ++c)
    for (int i = 0; i < blocks; ++i)
      sum[i] += along[c] * Modes<T>::read(s.h_change[c].data() + k + i * step<T>);
  for (int i = 0; i < blocks; ++i)
    write_modes(sum[i], b.n - k - i * step<T>, a + k + i * step<T>);
}

// p_ddot = Q_f - m^T A + sum of P^T f, by multipliers without Q_f; z holds, by rows of W, -A and forces on ports, and
// zeros elsewhere (and becomes another with geometric stiffening)
template <bool by_multipliers, class T> inline void modal_accelerations(const Body &b, T *z, const State<T> &s, T *a) {
  if (b.stiffening)
    return s.bent.accelerate(z, by_multipliers, a);
  T along[3];
  for (std::size_t c = 0; c < b.twists.size(); ++c) {
    const double *axis = b.twists[c].axis + 3;
    along[c] = axis[0] * z[3] + axis[1] * z[4] + axis[2] * z[5];
  }
  with_modes<T>(b.n, [&](auto known) {
    const int n = known ? known : b.n;
    int k = 0;
    for (; k + step<T> < n; k += 2 * step<T>)
      accelerate<2, by_multipliers, T>(b, padded(n), z, along, s, k, a);
    if (k < n)
      accelerate<1, by_multipliers, T>(b, padded(n), z, along, s, k, a);
  });
}

} // namespace ffrobot::recursion::spatial
