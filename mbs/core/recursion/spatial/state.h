// What of a spatial body changes from evaluation to evaluation.
#pragma once

#include "core/recursion/spatial/body.h"
#include "core/recursion/spatial/section.h"

namespace ffrobot::recursion::spatial {

template <class T> struct State {
  explicit State(const Body &b)
      : p(padded(b.n), T(0.)), v(p), Q_f(p), b(p), h_change{p, p, p}, u(b.width, T(0.)), u_dot(u), Q(u), Wh{u, u, u},
        ports(b.ports.size()) {}

  T absolute[3][3];       // body axes to global ones
  T omega[3];             // body axes
  T A[6];                 // of the last evaluation
  T s[3];                 // first moment
  T h_rate[3];            // m_thetaf p_dot
  Aligned<T> p, v;        // padded, as all vectors over modes
  Aligned<T> Q_f;         // modal forces
  Aligned<T> b;           // b_s, one after the other
  Aligned<T> h_change[3]; // A_c p
  Aligned<T> u, u_dot, Q; // W p, W p_dot, W Q_f with the undeformed m_thetaf
  Aligned<T> Wh[3];       // W A_c p
  std::vector<PortMotion<T>> ports;
};

} // namespace ffrobot::recursion::spatial
