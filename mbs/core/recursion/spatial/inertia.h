// The inertia of a spatial body with its modes eliminated, and the forces on it.
#pragma once

#include "core/recursion/spatial/stiffened.h"

namespace ffrobot::recursion::spatial {

// to = W x, of `count` vectors x over modes; most bodies have one port
template <int count, class T>
FFROBOT_INLINE void apply_W(const Body &b, const T *const (&x)[count], T *const (&to)[count]) {
  if (std::is_same_v<T, double> && b.width == 2 * lanes)
    return full_product<count, T>(b.W.data(), 2 * lanes, 2 * lanes, b.n, x, to);
  full_product<count, T>(b.W.data(), b.width, b.width, b.n, x, to);
}

// Forces on modes, elastic ones and what the caller adds (null: nothing)
template <class T> FFROBOT_INLINE void modal_forces(const Body &b, int n, const T *force, State<T> &s) {
  const double *K = b.K.data(), *D = b.D.data();
  const T *p = s.p.data(), *v = s.v.data();
  T *Q_f = s.Q_f.data();
  for (int k = 0; k < n; k += step<T>) {
    auto Q = Modes<T>::zero() - constants<T>(K + k) * Modes<T>::read(p + k);
    if (b.is_damped)
      Q -= constants<T>(D + k) * Modes<T>::read(v + k);
    Q.write(Q_f + k);
  }
  if (force)
    for (int k = 0; k < b.n; ++k)
      s.Q_f[k] += force[k];
  for (Index k = 0; k < b.D_full.rows(); ++k)
    for (Index j = 0; j < b.n; ++j)
      s.Q_f[k] -= b.D_full(k, j) * s.v[j];
}

// Takes p and p_dot over, with what they do to sections
template <class T> inline void project(const Body &b, const T *p, const T *v, const T *force, State<T> &s) {
  if (b.n == 0)
    return;
  read_modes(p, b.n, s.p.data()), read_modes(v, b.n, s.v.data());
  apply_W<2, T>(b, {s.p.data(), s.v.data()}, {s.u.data(), s.u_dot.data()});
  with_modes<T>(b.n, [&](auto known) { modal_forces(b, known ? known : b.n, force, s); });
  if (b.stiffening)
    bend(b, s);
  for (std::size_t i = 0; i < b.ports.size(); ++i)
    if (b.ports[i].is_flexible) {
      PortMotion<T> &m = s.ports[i];
      const int row = b.ports[i].row + 3;
      for (int k = 0; k < 3; ++k)
        m.phi[k] = s.u[row + k], m.phi_dot[k] = s.u_dot[row + k];
      turn_section(m);
    }
}

// J grows by T_s' (2 g_s + G_s p).p, T_s' = (tr T) I - T, at twice the rate of F = sum of T_s' b_s.p_dot; centrifugal
// forces on modes are (w.T_s' w) b_s. Products with g_s are rows of W.
template <class T> FFROBOT_INLINE void stretch(const Body &b, int n, State<T> &s, Pack<T, 6> &J, Pack<T, 6> &F) {
  const T *w = s.omega;
  const T ww[6] = {w[0] * w[0], w[1] * w[1], w[2] * w[2], w[0] * w[1], w[1] * w[2], w[2] * w[0]};
  auto by_stretch = Pack<T, lanes>::zero();
  for (int i = 0; i < 6; ++i)
    add_scaled(ww[i], b.tension[i], by_stretch);
  T tensions[lanes];
  by_stretch.write(tensions);
  T *Q_f = s.Q_f.data();
  const T *p = s.p.data(), *v = s.v.data(), *u = s.u.data(), *u_dot = s.u_dot.data(), *tension = tensions;
  for (const Stretch &of : b.stretches) {
    const double *g = of.g.data();
    auto growth = Modes<T>::zero(), rate = growth;
    const auto act = [&](int k, const Modes<T> &Gp) {
      growth += Gp * Modes<T>::read(p + k), rate += Gp * Modes<T>::read(v + k);
      (Modes<T>::read(Q_f + k) + *tension * (constants<T>(g + k) + Gp)).write(Q_f + k);
    };
    T E(0.), rate_of_E(0.);
    if (of.G.kind == ModeMatrix::Kind::zero)
      for (int k = 0; k < n; k += step<T>)
        (Modes<T>::read(Q_f + k) + *tension * constants<T>(g + k)).write(Q_f + k);
    else {
      if (const double *diagonal = of.G.values.data(); of.G.kind == ModeMatrix::Kind::diagonal)
        for (int k = 0; k < n; k += step<T>)
          act(k, constants<T>(diagonal + k) * Modes<T>::read(p + k));
      else {
        T *x = of.twist < 0 ? s.b.data() : s.h_change[of.twist].data();
        if (of.twist < 0)
          multiply<1, T>(of.G, n, {p}, {x});
        else
          multiply<2, T>(of.G, n, {p, v}, {x, s.by_rates[of.twist].data()});
        for (int k = 0; k < n; k += step<T>)
          act(k, Modes<T>::read(x + k));
      }
      E = growth.sum(), rate_of_E = rate.sum();
    }
    if (of.g_row >= 0)
      E += 2. * u[of.g_row], rate_of_E += u_dot[of.g_row];
    add_scaled(E, of.inertia, J), add_scaled(rate_of_E, of.inertia, F);
    ++tension;
  }
}

// What twists do to Coriolis forces and to m_thetaf p_dot, after `stretch`
template <class T> FFROBOT_INLINE void twist(const Body &b, int n, State<T> &s) {
  T *Q_f = s.Q_f.data();
  const T *p = s.p.data(), *v = s.v.data();
  int c = 0;
  for (const Twist &of : b.twists) {
    T *change = s.h_change[c].data(), *by_rates = s.by_rates[c++].data();
    const double *z = of.axis + 3;
    const T along = -2. * (z[0] * s.omega[0] + z[1] * s.omega[1] + z[2] * s.omega[2]);
    if (of.by_stretch.empty())
      multiply<2, T>(of.A, n, {p, v}, {change, by_rates});
    else
      for (int k = 0; k < n; k += step<T>) {
        const auto factor = constants<T>(of.by_stretch.data() + k);
        (factor * Modes<T>::read(change + k)).write(change + k);
        (factor * Modes<T>::read(by_rates + k)).write(by_rates + k);
      }
    auto rate = Modes<T>::zero();
    for (int k = 0; k < n; k += step<T>) {
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

// W Q_f and W h_c, most bodies having one twist or none
template <class T> FFROBOT_INLINE void project_forces(const Body &b, State<T> &s) {
  if (b.twists.size() == 1)
    return apply_W<2, T>(b, {s.Q_f.data(), s.h_change[0].data()}, {s.Q.data(), s.Wh[0].data()});
  const T *force = s.Q_f.data();
  T *to = s.Q.data();
  for (std::size_t c = 0;; force = s.h_change[c].data(), to = s.Wh[c].data(), ++c) {
    apply_W<1, T>(b, {force}, {to});
    if (c == b.twists.size())
      return;
  }
}

// m_thetaf = h + sum of z_c h_c: what of M_rr - m m^T and of m Q_f comes from the second part. With m the constant
// rows, M loses m h_c z_c^T + z_c h_c^T m^T + sum over e of z_c (h_c.h_e) z_e^T: r_c z_c^T and its transpose, if half
// of the last is with m h_c in r_c.
template <class T> FFROBOT_INLINE void eliminate_twists(const Body &b, int n, State<T> &s, FrameTerms<T> &to) {
  const int count = b.twists.size();
  const T *Q_f = s.Q_f.data();
  for (int c = 0; c < count; ++c) {
    const double *z = b.twists[c].axis;
    const T *h_c = s.h_change[c].data();
    const T along = modal_dot(n, h_c, Q_f);
    auto r = read_six(s.Wh[c].data());
    for (int e = 0; e < count; ++e)
      add_scaled(0.5 * modal_dot(n, h_c, static_cast<const T *>(s.h_change[e].data())), b.twists[e].axis, r);
    for (int i = 0; i < 6; ++i)
      add_scaled(T(-1.) * r[i], z, to.M[i]);
    for (int i = 0; i < 3; ++i) {
      to.bias[3 + i] += z[3 + i] * along;
      to.M[3 + i] -= T(z[3 + i]) * r;
    }
  }
}

// M_rr - m m^T without twists, which is known of the undeformed body; J grows by `change`, s~ by (S p)~
template <class T> FFROBOT_INLINE void frame_inertia(const Body &b, const State<T> &s, const T *change, Pack<T, 6> *M) {
  for (int i = 0; i < 6; ++i)
    M[i] = constant_row<6, T>(b.residual[i]);
  if (b.n == 0)
    return;
  const T *u = s.u.data();
  for (int i = 0; i < 3; ++i) { // s~_ij = -s_k
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    T x[6], y[6];
    x[0] = x[1] = x[2] = x[3 + i] = y[i] = T(0.);
    x[3 + j] = u[k], x[3 + k] = -u[j], y[j] = -u[k], y[k] = u[j];
    for (int l = 0; l < 3; ++l)
      y[3 + l] = change[symmetric_index(i, l)];
    M[i] += six(x[0], x[1], x[2], x[3], x[4], x[5]);
    M[3 + i] += six(y[0], y[1], y[2], y[3], y[4], y[5]);
  }
}

// -(Q_r - m Q_f) without twists; Fw: twice the rate of J by modes, times w
template <class T> FFROBOT_INLINE void frame_bias(const Body &b, const State<T> &s, const T *Fw, FrameTerms<T> &to) {
  const T *w = s.omega;
  T ws[3], Jw[3], wJw[3], wwS[3];
  symmetric_turn(to.J, w, Jw);
  cross(w, Jw, wJw), cross(w, s.s, ws), cross(w, ws, wwS);
  for (int i = 0; i < 3; ++i)
    to.bias[i] = wwS[i], to.bias[3 + i] = wJw[i];
  if (b.n == 0)
    return;
  T wS[3], wh[3];
  cross(w, s.u_dot.data(), wS), cross(w, s.h_rate, wh);
  for (int i = 0; i < 3; ++i) {
    to.bias[i] += 2. * wS[i] + s.Q[i];
    to.bias[3 + i] += Fw[i] + wh[i] + s.Q[3 + i];
  }
}

// `known`: padded modes, if that is known while compiling, or 0
template <int known, class T> inline void inertia_of(const Body &b, State<T> &s, FrameTerms<T> &to) {
  const int n = known ? known : b.n;
  auto J = Pack<T, 6>::zero(), F = J;
  T change[packed<T, 6>], F_now[packed<T, 6>], Fw[3];
  for (int i = 0; i < 3; ++i)
    s.s[i] = T(b.s0[i]);
  if (b.n) {
    const T *u = s.u.data(), *u_dot = s.u_dot.data();
    for (int i = 0; i < 3; ++i)
      s.s[i] += u[i], s.h_rate[i] = u_dot[Body::h + i];
    stretch(b, n, s, J, F), twist(b, n, s);
    const T w2[3] = {2. * s.omega[0], 2. * s.omega[1], 2. * s.omega[2]};
    F.write(F_now), J.write(change);
    symmetric_turn(F_now, w2, Fw);
  }
  (J + constant_row<6, T>(b.J0)).write(to.J);
  if (b.stiffening)
    return bent_inertia(b, s, Fw, to);
  if (b.n)
    project_forces(b, s);
  frame_inertia(b, s, change, to.M), frame_bias(b, s, Fw, to);
  if (b.n)
    eliminate_twists(b, n, s, to);
}

// M_rr - m m^T and -(Q_r - m Q_f), after `project`
template <class T> inline void inertia(const Body &b, State<T> &s, FrameTerms<T> &to) {
  with_modes<T>(b.n, [&](auto known) { inertia_of<known>(b, s, to); });
}

} // namespace ffrobot::recursion::spatial
