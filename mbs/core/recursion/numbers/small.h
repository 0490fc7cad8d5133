// Small matrices as rows in registers, and vectors of space.
#pragma once

#include "core/recursion/numbers/pack.h"

#include <cmath>

namespace ffrobot::recursion {

FFROBOT_INLINE double value_of(double x) { return x; }

FFROBOT_INLINE void sine_and_cosine(double x, double &s, double &c) { s = std::sin(x), c = std::cos(x); }

FFROBOT_INLINE double angle_of(double sine, double cosine) { return std::atan2(sine, cosine); }

// angle/sine of an angle from 0 to pi
FFROBOT_INLINE double angle_by_sine(double sine, double cosine) {
  return sine > 1e-9 ? std::atan2(sine, cosine) / sine : 1.;
}

// Results are written once all is read: compilers cannot know that they lie elsewhere.

template <class A, class B, class C> FFROBOT_INLINE void cross(const A *a, const B *b, C *c) {
  const C x = a[1] * b[2] - a[2] * b[1], y = a[2] * b[0] - a[0] * b[2], z = a[0] * b[1] - a[1] * b[0];
  c[0] = x, c[1] = y, c[2] = z;
}

template <class A, class B> FFROBOT_INLINE auto dot(const A *a, const B *b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

// y = R x and y = R^T x, R (3, 3)
template <class M, class X> FFROBOT_INLINE void turn(const M &R, const X *x, X *y) {
  X turned[3];
  for (int i = 0; i < 3; ++i)
    turned[i] = R[i][0] * x[0] + R[i][1] * x[1] + R[i][2] * x[2];
  for (int i = 0; i < 3; ++i)
    y[i] = turned[i];
}
template <class M, class X> FFROBOT_INLINE void turn_back(const M &R, const X *x, X *y) {
  X turned[3];
  for (int i = 0; i < 3; ++i)
    turned[i] = R[0][i] * x[0] + R[1][i] * x[1] + R[2][i] * x[2];
  for (int i = 0; i < 3; ++i)
    y[i] = turned[i];
}
template <class A, class B, class C> FFROBOT_INLINE void product(const A &a, const B &b, C (&c)[3][3]) {
  C found[3][3];
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      found[i][j] = a[i][0] * b[0][j] + a[i][1] * b[1][j] + a[i][2] * b[2][j];
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      c[i][j] = found[i][j];
}

// to = R, whose numbers may be of another kind
template <class M, class T> FFROBOT_INLINE void assign(const M &R, T (&to)[3][3]) {
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      if constexpr (requires { R(i, j); })
        to[i][j] = T(R(i, j));
      else
        to[i][j] = T(R[i][j]);
}
template <class T> FFROBOT_INLINE void assign_turn_about_z(const T &c, const T &s, T (&to)[3][3]) {
  const T zero(0.), R[3][3] = {{c, -s, zero}, {s, c, zero}, {zero, zero, T(1.)}};
  assign(R, to);
}

// Rotation vector x of R = exp(x~), which is no half turn
template <class M, class X> FFROBOT_INLINE void logarithm(const M &R, X *x) {
  for (int i = 0; i < 3; ++i)
    x[i] = 0.5 * (R[(i + 2) % 3][(i + 1) % 3] - R[(i + 1) % 3][(i + 2) % 3]);
  using std::sqrt;
  const X factor = angle_by_sine(sqrt(dot(x, x)), 0.5 * (R[0][0] + R[1][1] + R[2][2] - 1.));
  for (int i = 0; i < 3; ++i)
    x[i] = factor * x[i];
}

// Symmetric (3, 3) matrices are kept as xx, yy, zz, xy, yz, zx.
constexpr int symmetric_index(int i, int j) { return i == j ? i : 3 + ((i + 1) % 3 == j ? i : j); }
template <class M, class X, class Y> FFROBOT_INLINE void symmetric_turn(const M &S, const X *x, Y *y) {
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    y[i] = S[i] * x[i] + S[symmetric_index(i, j)] * x[j] + S[symmetric_index(i, k)] * x[k];
  }
}

// y = M x of rows; x has room for a Pack, with zeros behind its numbers
template <int d, class T> FFROBOT_INLINE void multiply(const Pack<T, d> *M, const T *x, T *y) {
  const auto all = Pack<T, d>::read(x);
  Pack<T, d> products[d];
  for (int i = 0; i < d; ++i)
    products[i] = M[i] * all;
  sums(products, y);
}

// y = M x, M symmetric, as a row
template <int d, class T> FFROBOT_INLINE Pack<T, d> symmetric_product(const Pack<T, d> *M, const T *x) {
  Pack<T, d> y = x[0] * M[0];
  for (int i = 1; i < d; ++i)
    y += x[i] * M[i];
  return y;
}

// The inverse of a symmetric positive definite matrix, in its place (Gauss and Jordan)
template <int d, class T> FFROBOT_NOINLINE void invert(Pack<T, d> *M) {
  for (int k = 0; k < d; ++k) {
    const T pivot = T(1.) / M[k][k];
    M[k].set(k, T(1.));
    M[k] = pivot * M[k];
    for (int i = 0; i < d; ++i)
      if (i != k) {
        const T factor = M[i][k];
        M[i].set(k, T(0.));
        M[i] -= factor * M[k];
      }
  }
}

} // namespace ffrobot::recursion
