// What of a spatial body changes from evaluation to evaluation.
#pragma once

#include "core/recursion/spatial/bent_modes.h"
#include "core/recursion/spatial/body.h"
#include "core/recursion/spatial/section.h"

namespace ffrobot::recursion::spatial {

// Of a body with geometric stiffening; names as in stiffening.h
template <class T> struct Bent : BentModes<T> {
  explicit Bent(const Body &b)
      : BentModes<T>(b.stiffening ? b.n : 0, b.stiffening ? b.width : 0),
        F(b.stiffening ? 3 * b.stiffening->fields * padded(b.n) : 0, T(0.)), gram(this->width * this->width, T(0.)) {}

  struct Affine { // of the fields, by axis and field
    T g[3][most_fields], g_dot[3][most_fields];
  };
  Affine linear, all;        // without and with terms of second order
  T bending[3][most_fields]; // p_dot^T K p_dot
  Aligned<T> F;              // (3 fields, padded n) F(p)
  Aligned<T> gram;           // (width, width) W(p) m_ff^-1 W(p)^T
};

template <class T> struct State {
  explicit State(const Body &b)
      : p(padded(b.n), T(0.)), v(p), Q_f(p), b(p), h_change{p, p, p}, by_rates{p, p, p}, u(b.width, T(0.)), u_dot(u),
        Q(u), Wh{u, u, u}, ports(b.ports.size()), bent(b) {}

  T absolute[3][3];       // body axes to global ones
  T omega[3];             // body axes
  T A[6];                 // of the last evaluation
  T s[3];                 // first moment
  T h_rate[3];            // m_thetaf p_dot
  Aligned<T> p, v;        // padded, as all vectors over modes
  Aligned<T> Q_f;         // modal forces
  Aligned<T> b;           // b_s, one after the other
  Aligned<T> h_change[3]; // A_c p
  Aligned<T> by_rates[3]; // A_c p_dot
  Aligned<T> u, u_dot, Q; // W p, W p_dot, W Q_f with the undeformed m_thetaf
  Aligned<T> Wh[3];       // W A_c p
  std::vector<PortMotion<T>> ports;
  Bent<T> bent; // empty without geometric stiffening
};

// What becomes of a body in its frame's six equations: J (as symmetric matrices are kept); where the caller wants them,
// M_rr - m m^T (6 rows) and -(Q_r - m Q_f) (6)
template <class T> struct FrameTerms {
  FrameTerms(Pack<T, 6> *to_M, T *to_bias) : M(to_M), bias(to_bias) {}
  T J[packed<T, 6>];
  Pack<T, 6> *M;
  T *bias;
};

} // namespace ffrobot::recursion::spatial
