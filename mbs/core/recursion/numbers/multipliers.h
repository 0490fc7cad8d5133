// The small system of the multipliers, C M^-1 C^T lambda = what constraints measure without them, less their targets: L
// D L^T.
#pragma once

#include "core/recursion/numbers/pack.h"

namespace ffrobot::recursion {

// The lower half of a symmetric matrix (m, m), by rows, becomes L and 1/D; what is above becomes D L^T.
template <class T> inline void factorise(T *M, int m) {
  for (int j = 0; j < m; ++j) {
    const T inverse = T(1.) / M[j * m + j];
    T *above = M + j * m; // column j side by side
    for (int r = j + 1; r < m; ++r)
      above[r] = M[r * m + j];
    for (int r = j + 1; r < m; ++r) {
      const T x = M[r * m + j] * inverse;
      for (int c = j + 1; c <= r; ++c)
        M[r * m + c] -= x * above[c];
      M[r * m + j] = x;
    }
    above[j] = inverse;
  }
}

// With these factors: m numbers
template <class T> inline void solve_factorised(const T *factor, int m, T *x) {
  for (int r = 0; r < m; ++r)
    for (int c = 0; c < r; ++c)
      x[r] -= factor[r * m + c] * x[c];
  for (int r = m - 1; r >= 0; --r) {
    x[r] = x[r] * factor[r * m + r];
    for (int k = r + 1; k < m; ++k)
      x[r] -= factor[k * m + r] * x[k];
  }
}

// Two constraints: both divisions at once
template <class T, int W> FFROBOT_INLINE void solve_two(const Pack<T, W> *S, T *x, T *factor) {
  const T a = S[1][1], b = S[2][1], c = S[2][2];
  const T D_a = T(1.) / a, D_c = a / (a * c - b * b), L = b * D_a;
  factor[0] = D_a, factor[2] = L, factor[3] = D_c;
  x[1] = (x[1] - L * x[0]) * D_c;
  x[0] = x[0] * D_a - L * x[1];
}

// Constraints 1 … of S in the registers that the recursion has left; fewer constraints than W - 1 are filled up by the
// caller.
template <class T, int W> FFROBOT_INLINE void solve_multipliers(const Pack<T, W> *S, T *x, T *factor) {
  constexpr int m = W - 1;
  if constexpr (m > 8) { // too many for registers
    for (int r = 0; r < m; ++r)
      for (int c = 0; c <= r; ++c)
        factor[r * m + c] = S[r + 1][c + 1];
    factorise(factor, m);
    solve_factorised(factor, m, x);
    return;
  }
  if constexpr (m == 2)
    return solve_two(S, x, factor);
  T M[m][m], D[m];
#pragma GCC unroll 8
  for (int r = 0; r < m; ++r)
#pragma GCC unroll 8
    for (int c = 0; c <= r; ++c)
      M[r][c] = S[r + 1][c + 1];
#pragma GCC unroll 8
  for (int j = 0; j < m; ++j) {
    D[j] = T(1.) / M[j][j];
#pragma GCC unroll 8
    for (int r = j + 1; r < m; ++r) {
      const T x_r = M[r][j] * D[j];
#pragma GCC unroll 8
      for (int c = j + 1; c <= r; ++c)
        M[r][c] -= x_r * M[c][j];
    }
#pragma GCC unroll 8
    for (int r = j + 1; r < m; ++r)
      M[r][j] *= D[j];
  }
#pragma GCC unroll 8
  for (int r = 0; r < m; ++r) {
    factor[r * m + r] = D[r];
#pragma GCC unroll 8
    for (int c = 0; c < r; ++c)
      factor[r * m + c] = M[r][c], x[r] -= M[r][c] * x[c];
  }
#pragma GCC unroll 8
  for (int r = m - 1; r >= 0; --r) {
    x[r] = x[r] * D[r];
#pragma GCC unroll 8
    for (int k = r + 1; k < m; ++k)
      x[r] -= M[k][r] * x[k];
  }
}

} // namespace ffrobot::recursion
