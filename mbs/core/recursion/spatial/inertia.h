// The inertia of a spatial body with its modes eliminated, and the forces on it.
#pragma once

#include "core/recursion/spatial/state.h"

namespace ffrobot::recursion::spatial {

// to = W x, x over modes
template <class T> FFROBOT_INLINE void apply_W(const Body &b, const T *x, T *to) {
  for (int r = 0; r < b.width; r += lanes) {
    auto sum = Pack<T, lanes>::zero();
    const double *row = b.W.data() + r;
    for (int k = 0; k < b.n; ++k, row += b.width)
      add_scaled(x[k], row, sum);
    sum.write(to + r);
  }
}

// Forces on modes, elastic ones and what the caller adds (null: nothing)
template <class T> FFROBOT_INLINE void modal_forces(const Body &b, const T *force, State<T> &s) {
  for (int k = 0; k < b.n; k += step<T>) {
    auto Q = constants<T>(b.K.data() + k) * Modes<T>::read(s.p.data() + k);
    if (b.is_damped)
      Q += constants<T>(b.D.data() + k) * Modes<T>::read(s.v.data() + k);
    (Modes<T>::zero() - Q).write(s.Q_f.data() + k);
  }
  if (force)
    for (int k = 0; k < b.n; ++k)
      s.Q_f[k] += force[k];
  for (Eigen::Index k = 0; k < b.D_full.rows(); ++k)
    for (Eigen::Index j = 0; j < b.n; ++j)
      s.Q_f[k] -= b.D_full(k, j) * s.v[j];
}

// Takes p and p_dot over, with what they do to sections
template <class T> inline void project(const Body &b, const T *p, const T *v, const T *force, State<T> &s) {
  if (b.n == 0)
    return;
  for (int k = 0; k < b.n; ++k)
    s.p[k] = p[k], s.v[k] = v[k];
  apply_W(b, s.p.data(), s.u.data()), apply_W(b, s.v.data(), s.u_dot.data());
  modal_forces(b, force, s);
  for (std::size_t i = 0; i < b.ports.size(); ++i)
    if (b.ports[i].is_soft) {
      PortMotion<T> &m = s.ports[i];
      const int row = b.ports[i].row + 3;
      for (int k = 0; k < 3; ++k)
        m.phi[k] = s.u[row + k], m.phi_dot[k] = s.u_dot[row + k];
      turn_section(m);
    }
}

// What stretches do: J grows by the sum of T_s' (2 g_s + G_s p).p, T' = (tr T) I - T; its rate is 2 F, F = sum of
// T_s' b_s.p_dot; centrifugal forces on modes are (w.T_s' w) b_s.
template <class T> FFROBOT_INLINE void stretch(const Body &b, State<T> &s, Pack<T, 6> *F) {
  const T *w = s.omega;
  const T ww[6] = {w[0] * w[0], w[1] * w[1], w[2] * w[2], w[0] * w[1], w[1] * w[2], w[2] * w[0]};
  auto by_stretch = Pack<T, lanes>::zero();
  for (int i = 0; i < 6; ++i)
    add_scaled(ww[i], b.tension[i], by_stretch);
  T tension[lanes];
  by_stretch.write(tension);
  int i = 0;
  for (const Stretch &of : b.stretches) {
    multiply(of.G, b.n, s.p.data(), s.b.data());
    auto growth = Modes<T>::zero(), rate = growth;
    for (int k = 0; k < b.n; k += step<T>) {
      auto x = Modes<T>::read(s.b.data() + k);
      const auto p = Modes<T>::read(s.p.data() + k), v = Modes<T>::read(s.v.data() + k);
      if (of.has_g) {
        const auto g = constants<T>(of.g.data() + k);
        x += g, growth += g * p;
      }
      growth += x * p, rate += x * v;
      (Modes<T>::read(s.Q_f.data() + k) + tension[i] * x).write(s.Q_f.data() + k);
    }
    const T E_s = growth.sum(), F_s = rate.sum();
    for (int r = 0; r < 3; ++r)
      add_scaled(E_s, of.inertia[r], s.J[r]), add_scaled(F_s, of.inertia[r], F[r]);
    ++i;
  }
}

// What twists do to Coriolis forces and to m_thetaf p_dot
template <class T> FFROBOT_INLINE void twist(const Body &b, State<T> &s) {
  int c = 0;
  for (const Twist &of : b.twists) {
    T *change = s.h_change[c++].data();
    const double *z = of.axis + 3;
    const T along = -2. * (z[0] * s.omega[0] + z[1] * s.omega[1] + z[2] * s.omega[2]);
    multiply(of.A, b.n, s.p.data(), change), multiply(of.A, b.n, s.v.data(), s.b.data());
    auto rate = Modes<T>::zero();
    for (int k = 0; k < b.n; k += step<T>) {
      (Modes<T>::read(s.Q_f.data() + k) + along * Modes<T>::read(s.b.data() + k)).write(s.Q_f.data() + k);
      rate += Modes<T>::read(change + k) * Modes<T>::read(s.v.data() + k);
    }
    const T sum = rate.sum();
    for (int i = 0; i < 3; ++i)
      s.h_rate[i] += z[i] * sum;
  }
}

template <class T> FFROBOT_INLINE T modal_dot(const Body &b, const Aligned<T> &x, const Aligned<T> &y) {
  auto sum = Modes<T>::zero();
  for (int k = 0; k < b.n; k += step<T>)
    sum += Modes<T>::read(x.data() + k) * Modes<T>::read(y.data() + k);
  return sum.sum();
}

// m_thetaf = h + sum of z_c h_c: what of M_rr - m m^T and of m Q_f comes from the second part
template <class T> FFROBOT_INLINE void eliminate_twists(const Body &b, State<T> &s) {
  const int count = static_cast<int>(b.twists.size());
  for (int c = 0; c < count; ++c) {
    const double *z = b.twists[c].axis;
    T *Wh = s.Wh[c].data();
    apply_W(b, s.h_change[c].data(), Wh);
    const T along = modal_dot(b, s.h_change[c], s.Q_f);
    for (int i = 0; i < 3; ++i)
      s.bias[3 + i] += z[3 + i] * along;
    const auto rows = Pack<T, 6>::read(Wh);
    for (int i = 0; i < 6; ++i)
      add_scaled(T(-1.) * Wh[i], z, s.M[i]);
    for (int i = 0; i < 3; ++i)
      s.M[3 + i] -= T(z[3 + i]) * rows;
    for (int e = 0; e < count; ++e) {
      const T both = modal_dot(b, s.h_change[c], s.h_change[e]);
      for (int i = 0; i < 3; ++i)
        add_scaled(-z[3 + i] * both, b.twists[e].axis, s.M[3 + i]);
    }
  }
}

// M_rr - m m^T without twists: J is known, s~ grows by (S p)~
template <class T> FFROBOT_INLINE void frame_inertia(const Body &b, State<T> &s) {
  for (int i = 0; i < 3; ++i) {
    s.M[i] = constant_row<6, T>(b.residual[i]);
    s.M[3 + i] = constant_row<6, T>(b.residual[3 + i]) + s.J[i];
    s.J[i] += constant_row<6, T>(b.J0[i]);
  }
  if (b.n == 0)
    return;
  const T *u = s.u.data();
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3; // s~_kj = s_i
    s.M[3 + k].add(j, u[i]), s.M[3 + j].add(k, -u[i]);
    s.M[j].add(3 + k, u[i]), s.M[k].add(3 + j, -u[i]);
  }
}

// -(Q_r - m Q_f) without twists, F as above
template <class T> FFROBOT_INLINE void frame_bias(const Body &b, const Pack<T, 6> *F, State<T> &s) {
  const T *w = s.omega;
  T ws[3], Jw[3], wJw[3], wwS[3];
  auto sum = w[0] * s.J[0] + w[1] * s.J[1] + w[2] * s.J[2];
  for (int i = 0; i < 3; ++i)
    Jw[i] = sum[3 + i];
  cross(w, Jw, wJw), cross(w, s.s, ws), cross(w, ws, wwS);
  for (int i = 0; i < 3; ++i)
    s.bias[i] = wwS[i], s.bias[3 + i] = wJw[i];
  if (b.n == 0)
    return;
  T wS[3], wh[3];
  sum = w[0] * F[0] + w[1] * F[1] + w[2] * F[2];
  cross(w, s.u_dot.data(), wS), cross(w, s.h_rate, wh);
  for (int i = 0; i < 3; ++i) {
    s.bias[i] += 2. * wS[i] + s.Q[i];
    s.bias[3 + i] += 2. * sum[3 + i] + wh[i] + s.Q[3 + i];
  }
}

// M_rr - m m^T and -(Q_r - m Q_f), after `project`
template <class T> inline void inertia(const Body &b, State<T> &s) {
  const auto none = Pack<T, 6>::zero();
  Pack<T, 6> F[3] = {none, none, none};
  for (int i = 0; i < 3; ++i)
    s.s[i] = T(b.s0[i]), s.J[i] = none;
  if (b.n) {
    for (int i = 0; i < 3; ++i)
      s.s[i] += s.u[i], s.h_rate[i] = s.u_dot[Body::h + i];
    stretch(b, s, F), twist(b, s);
    apply_W(b, s.Q_f.data(), s.Q.data());
  }
  frame_inertia(b, s), frame_bias(b, F, s);
  if (b.n)
    eliminate_twists(b, s);
}

} // namespace ffrobot::recursion::spatial
