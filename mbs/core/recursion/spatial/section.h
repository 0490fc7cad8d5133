// How the section of a port turns: by exp(phi), with the exact Jacobian J_l, so that reactions do no work.
#pragma once

#include "core/recursion/numbers/small.h"
#include "core/recursion/spatial/mode_matrix.h"

#include <array>

namespace ffrobot::recursion::spatial {

// A port and the section there
template <class T> struct PortMotion {
  T r[3];                   // body axes, deformed
  T phi[3], phi_dot[3];     // rotation vector of the section and its rate, undeformed axes
  T turn[3][3];             // exp(phi)
  T excess[3][3];           // J_l(phi) - I
  T columns[3][lanes] = {}; // its columns, in the place of a moment
  T rate[3];                // J_l phi_dot, angular velocity of the section against the body, undeformed axes
  T drift[3];               // (d/dt J_l) phi_dot
};

constexpr int series_terms = 9; // of the sums below: 1e-16 up to 1.3 rad, beyond which closed forms lose no digits
constexpr int few_terms = 5;    // 1e-18 as long as y is small
constexpr double small_y = 1. / 256, large_y = 1.69;

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
template <int terms, class T>
FFROBOT_INLINE void power_series(const std::array<double, series_terms> &c, const T &y, T &sum, T &slope) {
  sum = T(c[terms - 1]), slope = T(0.);
#pragma GCC unroll 8
  for (int k = terms - 2; k >= 0; --k)
    slope = slope * y + sum, sum = sum * y + c[k];
}

// (1 - cos)/x^2, (x - sin)/x^3 and their derivatives by y = x^2, of any x
template <class T> inline void rotation_series(const T &y, T &a, T &b, T &a_rate, T &b_rate) {
  constexpr auto of_a = alternating_factorials<2>(), of_b = alternating_factorials<3>();
  if (value_of(y) < small_y)
    power_series<few_terms>(of_a, y, a, a_rate), power_series<few_terms>(of_b, y, b, b_rate);
  else if (value_of(y) < large_y)
    power_series<series_terms>(of_a, y, a, a_rate), power_series<series_terms>(of_b, y, b, b_rate);
  else {
    using std::sqrt;
    const T x = sqrt(y);
    T sine, cosine;
    sine_and_cosine(x, sine, cosine);
    a = (1. - cosine) / y, b = (x - sine) / (x * y);
    a_rate = 0.5 * (sine / x - 2. * a) / y, b_rate = 0.5 * (a - 3. * b) / y;
  }
}

// exp(phi) = I + (1 - y b) phi~ + a phi~^2, J_l = I + a phi~ + b phi~^2, y = |phi|^2, from phi and phi_dot
template <class T> FFROBOT_INLINE void turn_section(PortMotion<T> &m) {
  const T *f = m.phi, *d = m.phi_dot, y = dot(f, f), y_dot = 2. * dot(f, d);
  T a, b, a_rate, b_rate, fd[3], ffd[3], dfd[3];
  rotation_series(y, a, b, a_rate, b_rate);
  const T sinc = 1. - y * b;
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;           // phi~_kj = phi_i
    const T here = f[i] * f[i] - y, beside = f[j] * f[k]; // of phi~^2
    m.excess[i][i] = b * here, m.turn[i][i] = a * here + 1.;
    m.excess[k][j] = b * beside + a * f[i], m.excess[j][k] = b * beside - a * f[i];
    m.turn[k][j] = a * beside + sinc * f[i], m.turn[j][k] = a * beside - sinc * f[i];
  }
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      m.columns[j][3 + i] = m.excess[i][j];
  cross(f, d, fd), cross(f, fd, ffd), cross(d, fd, dfd);
  for (int i = 0; i < 3; ++i) {
    m.rate[i] = d[i] + a * fd[i] + b * ffd[i];
    m.drift[i] = a_rate * y_dot * fd[i] + b_rate * y_dot * ffd[i] + b * dfd[i];
  }
}

} // namespace ffrobot::recursion::spatial
