// Ports of a spatial body, and its modes by what acts on them.
#pragma once

#include "core/recursion/spatial/inertia.h"

namespace ffrobot::recursion::spatial {

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

// What velocities do to the acceleration of the section, with Phi Q_f
template <class T> FFROBOT_INLINE void port_bias(const Body &b, int i, const State<T> &s, T *beta) {
  const Port &port = b.ports[i];
  const PortMotion<T> &m = s.ports[i];
  const T *w = s.omega;
  T wr[3], wwr[3];
  cross(w, m.r, wr), cross(w, wr, wwr);
  if (!port.is_soft) {
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
  const Port &port = b.ports[i];
  for (int r = 0; r < 6; ++r)
    X[r] = constant_row<6, T>(port.T[r]);
  if (!port.is_soft)
    return;
  const T *du = s.u.data() + port.row;
  for (int i1 = 0; i1 < 3; ++i1) { // e_k . (alpha x R du) = alpha . R (du x e_k)
    const int i2 = (i1 + 1) % 3, i3 = (i1 + 2) % 3;
    add_scaled(du[i3], port.turning[i2], X[i1]), add_scaled(T(-1.) * du[i2], port.turning[i3], X[i1]);
  }
  Pack<T, 6> P[3]; // Phi_r m^T
  if (b.stiffening)
    bent_port(b, s, port.row, X, P);
  else
    for (int r = 0; r < 3; ++r)
      P[r] = constant_row<6, T>(b.gram(port.row + 3 + r, 0));
  for (std::size_t c = 0; c < b.twists.size() && !b.stiffening; ++c) {
    const double *z = b.twists[c].axis;
    const T *Wh = s.Wh[c].data() + port.row;
    for (int r = 0; r < 6; ++r)
      add_scaled(T(-1.) * Wh[r], z, X[r]);
    for (int r = 0; r < 3; ++r)
      add_scaled(Wh[3 + r], z, P[r]);
  }
  const auto &excess = s.ports[i].excess;
  for (int r = 0; r < 3; ++r)
    X[3 + r] -= excess[r][0] * P[0] + excess[r][1] * P[1] + excess[r][2] * P[2];
}

// G of forces on port j by accelerations of port i: H_i Phi_i Phi_j^T H_j^T
template <class T> FFROBOT_APART void port_gram(const Body &b, const State<T> &s, int i, int j, Pack<T, 6> *G) {
  const auto &L = s.ports[i].excess, &R = s.ports[j].excess;
  Pack<T, 6> columns[3], left[3]; // of H_j^T - 1
  for (int k = 0; k < 3; ++k) {
    columns[k] = Pack<T, 6>::zero();
    for (int c = 0; c < 3; ++c)
      columns[k].set(3 + c, R[c][k]);
  }
  for (int r = 0; r < 6; ++r)
    G[r] = b.stiffening ? Pack<T, 6>::read(s.bent.gram.data() + (b.ports[i].row + r) * b.width + b.ports[j].row)
                        : constant_row<6, T>(b.gram(b.ports[i].row + r, b.ports[j].row));
  for (int r = 0; r < 3; ++r)
    left[r] = L[r][0] * G[3] + L[r][1] * G[4] + L[r][2] * G[5];
  for (int r = 0; r < 3; ++r)
    G[3 + r] += left[r];
  for (int r = 0; r < 6; ++r)
    G[r] += G[r][3] * columns[0] + G[r][4] * columns[1] + G[r][5] * columns[2];
}

// A_port = X A + beta + G f of a port, in axes of the undeformed section; f: force and moment on it
template <class T>
FFROBOT_APART void port_rows(const Body &b, int i, State<T> &s, Pack<T, 6> *X, T *beta, Pack<T, 6> *G) {
  port_bias(b, i, s, beta);
  port_by_frame(b, i, s, X);
  if (b.ports[i].is_soft)
    port_gram(b, s, i, i, G);
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
  if (b.stiffening)
    return bent_accelerations<by_multipliers>(b, z, s, a);
  T along[3];
  for (std::size_t c = 0; c < b.twists.size(); ++c) {
    const double *axis = b.twists[c].axis + 3;
    along[c] = axis[0] * z[3] + axis[1] * z[4] + axis[2] * z[5];
  }
  for (int k = 0; k < b.n; k += step<T>) {
    auto sum = by_multipliers ? Modes<T>::zero() : Modes<T>::read(s.Q_f.data() + k);
    for (int first = 0; first < b.width; first += lanes)
      for (int r = first; r < first + 6; ++r)
        add_scaled(z[r], b.rows.data() + r * padded(b.n) + k, sum);
    for (std::size_t c = 0; c < b.twists.size(); ++c)
      sum += along[c] * Modes<T>::read(s.h_change[c].data() + k);
    write_modes(sum, b.n - k, a + k);
  }
}

} // namespace ffrobot::recursion::spatial
