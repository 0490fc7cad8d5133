// The inertia of a spatial body with its modes eliminated, and the forces on it.
#pragma once

#include "core/recursion/spatial/bent.h"

namespace ffrobot::recursion::spatial {

// to = W x, of `count` vectors x over modes
template <int count, class T>
FFROBOT_INLINE void apply_W(const Body &b, const T *const (&x)[count], T *const (&to)[count]) {
  full_product<count, T>(b.W.data(), b.width, b.width, b.n, x, to);
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
  read_modes(p, b.n, s.p.data()), read_modes(v, b.n, s.v.data());
  apply_W<2, T>(b, {s.p.data(), s.v.data()}, {s.u.data(), s.u_dot.data()});
  modal_forces(b, force, s);
  if (b.stiffening)
    bend(b, s);
  for (std::size_t i = 0; i < b.ports.size(); ++i)
    if (b.ports[i].is_soft) {
      PortMotion<T> &m = s.ports[i];
      const int row = b.ports[i].row + 3;
      for (int k = 0; k < 3; ++k)
        m.phi[k] = s.u[row + k], m.phi_dot[k] = s.u_dot[row + k];
      turn_section(m);
    }
}

// J and M are sums over stretches of T_s' = (tr T) I - T: J grows by T_s' (2 g_s + G_s p).p, at twice the rate of
// F = sum of T_s' b_s.p_dot; centrifugal forces on modes are (w.T_s' w) b_s. Products with g_s are rows of W.
template <class T> FFROBOT_INLINE void stretch(const Body &b, State<T> &s, T *E, T *F) {
  const T *w = s.omega;
  const T ww[6] = {w[0] * w[0], w[1] * w[1], w[2] * w[2], w[0] * w[1], w[1] * w[2], w[2] * w[0]};
  auto by_stretch = Pack<T, lanes>::zero();
  for (int i = 0; i < 6; ++i)
    add_scaled(ww[i], b.tension[i], by_stretch);
  T tension[lanes];
  by_stretch.write(tension);
  T *x = s.b.data(), *Q_f = s.Q_f.data();
  const T *p = s.p.data(), *v = s.v.data();
  int i = 0;
  for (const Stretch &of : b.stretches) {
    const bool grows = of.G.kind != ModeMatrix::Kind::zero;
    if (grows)
      multiply<1, T>(of.G, b.n, {p}, {x});
    auto growth = Modes<T>::zero(), rate = growth;
    for (int k = 0; k < b.n; k += step<T>) {
      auto b_s = constants<T>(of.g.data() + k);
      if (grows) {
        const auto x_k = Modes<T>::read(x + k);
        b_s += x_k, growth += x_k * Modes<T>::read(p + k), rate += x_k * Modes<T>::read(v + k);
      }
      (Modes<T>::read(Q_f + k) + tension[i] * b_s).write(Q_f + k);
    }
    E[i] = F[i] = T(0.);
    if (grows)
      E[i] = growth.sum(), F[i] = rate.sum();
    if (of.g_row >= 0)
      E[i] += 2. * s.u[of.g_row], F[i] += s.u_dot[of.g_row];
    ++i;
  }
}

// What twists do to Coriolis forces and to m_thetaf p_dot
template <class T> FFROBOT_INLINE void twist(const Body &b, State<T> &s) {
  int c = 0;
  T *Q_f = s.Q_f.data(), *by_rates = s.b.data();
  const T *p = s.p.data(), *v = s.v.data();
  for (const Twist &of : b.twists) {
    T *change = s.h_change[c++].data();
    const double *z = of.axis + 3;
    const T along = -2. * (z[0] * s.omega[0] + z[1] * s.omega[1] + z[2] * s.omega[2]);
    multiply<2, T>(of.A, b.n, {p, v}, {change, by_rates});
    auto rate = Modes<T>::zero();
    for (int k = 0; k < b.n; k += step<T>) {
      (Modes<T>::read(Q_f + k) + along * Modes<T>::read(by_rates + k)).write(Q_f + k);
      rate += Modes<T>::read(change + k) * Modes<T>::read(v + k);
    }
    const T sum = rate.sum();
    for (int i = 0; i < 3; ++i)
      s.h_rate[i] += z[i] * sum;
  }
}

template <class T> FFROBOT_INLINE T modal_dot(int n, const T *x, const T *y) {
  auto sum = Modes<T>::zero();
  for (int k = 0; k < n; k += step<T>)
    sum += Modes<T>::read(x + k) * Modes<T>::read(y + k);
  return sum.sum();
}

// m_thetaf = h + sum of z_c h_c: what of M_rr - m m^T and of m Q_f comes from the second part
template <class T> FFROBOT_INLINE void eliminate_twists(const Body &b, State<T> &s, FrameTerms<T> &to) {
  const int count = static_cast<int>(b.twists.size());
  for (int c = 0; c < count; ++c) {
    const double *z = b.twists[c].axis;
    const T *h_c = s.h_change[c].data();
    T *Wh = s.Wh[c].data();
    apply_W<1, T>(b, {h_c}, {Wh});
    const T along = modal_dot(b.n, h_c, static_cast<const T *>(s.Q_f.data()));
    const auto rows = read_six(Wh);
    for (int i = 0; i < 6; ++i)
      add_scaled(T(-1.) * rows[i], z, to.M[i]);
    for (int i = 0; i < 3; ++i) {
      to.bias[3 + i] += z[3 + i] * along;
      to.M[3 + i] -= T(z[3 + i]) * rows;
    }
    for (int e = 0; e < count; ++e) {
      const T both = modal_dot(b.n, h_c, static_cast<const T *>(s.h_change[e].data()));
      for (int i = 0; i < 3; ++i)
        add_scaled(-z[3 + i] * both, b.twists[e].axis, to.M[3 + i]);
    }
  }
}

// M_rr - m m^T without twists: J is known less that of the undeformed body; s~ grows by (S p)~
template <class T> FFROBOT_INLINE void frame_inertia(const Body &b, const State<T> &s, FrameTerms<T> &to) {
  for (int i = 0; i < 3; ++i) {
    to.M[i] = constant_row<6, T>(b.residual[i]);
    to.M[3 + i] = constant_row<6, T>(b.residual[3 + i]) + to.J[i];
    to.J[i] += constant_row<6, T>(b.J0[i]);
  }
  if (b.n == 0)
    return;
  const T u[3] = {s.u[0], s.u[1], s.u[2]};
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3; // s~_kj = s_i
    to.M[3 + k].add(j, u[i]), to.M[3 + j].add(k, -u[i]);
    to.M[j].add(3 + k, u[i]), to.M[k].add(3 + j, -u[i]);
  }
}

// -(Q_r - m Q_f) without twists; Fw: twice the rate of J by modes, times w, in the place of alpha
template <class T>
FFROBOT_INLINE void frame_bias(const Body &b, const State<T> &s, const Pack<T, 6> &Fw, FrameTerms<T> &to) {
  const T *w = s.omega;
  T ws[3], wJw[3], wwS[3];
  const auto all = w[0] * to.J[0] + w[1] * to.J[1] + w[2] * to.J[2];
  const T Jw[3] = {all[3], all[4], all[5]};
  cross(w, Jw, wJw), cross(w, s.s, ws), cross(w, ws, wwS);
  for (int i = 0; i < 3; ++i)
    to.bias[i] = wwS[i], to.bias[3 + i] = wJw[i];
  if (b.n == 0)
    return;
  T wS[3], wh[3];
  cross(w, s.u_dot.data(), wS), cross(w, s.h_rate, wh);
  for (int i = 0; i < 3; ++i) {
    to.bias[i] += 2. * wS[i] + s.Q[i];
    to.bias[3 + i] += Fw[3 + i] + wh[i] + s.Q[3 + i];
  }
}

// M_rr - m m^T and -(Q_r - m Q_f), after `project`
template <class T> inline void inertia(const Body &b, State<T> &s, FrameTerms<T> &to) {
  auto Fw = Pack<T, 6>::zero();
  for (int i = 0; i < 3; ++i)
    s.s[i] = T(b.s0[i]), to.J[i] = Pack<T, 6>::zero();
  if (b.n) {
    T E[lanes], F[lanes];
    for (int i = 0; i < 3; ++i)
      s.s[i] += s.u[i], s.h_rate[i] = s.u_dot[Body::h + i];
    stretch(b, s, E, F), twist(b, s);
    const T w2[3] = {2. * s.omega[0], 2. * s.omega[1], 2. * s.omega[2]};
    int i = 0;
    for (const Stretch &of : b.stretches) {
      for (int r = 0; r < 3; ++r)
        add_scaled(E[i], of.inertia[r], to.J[r]), add_scaled(F[i] * w2[r], of.inertia[r], Fw);
      ++i;
    }
    if (b.stiffening)
      return bent_inertia(b, s, Fw, to);
    apply_W<1, T>(b, {s.Q_f.data()}, {s.Q.data()});
  }
  frame_inertia(b, s, to), frame_bias(b, s, Fw, to);
  if (b.n)
    eliminate_twists(b, s, to);
}

} // namespace ffrobot::recursion::spatial
