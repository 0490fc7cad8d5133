// The small system of the multipliers, C M^-1 C^T lambda = what rows measure without them, less their targets: L D L^T.
#pragma once

#include "core/recursion/pack.h"

namespace ffrobot::recursion {

// Rows 1 … of S in the registers that the recursion has left; fewer rows than W - 1 are filled up by the caller.
template <class T, int W> FFROBOT_INLINE void solve_multipliers(const Pack<T, W> *S, T *x, T *factor) {
  constexpr int m = W - 1;
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

// With the factors of the last: W - 1 numbers
template <class T> inline void solve_again(const T *factor, int m, T *x) {
  for (int r = 0; r < m; ++r)
    for (int c = 0; c < r; ++c)
      x[r] -= factor[r * m + c] * x[c];
  for (int r = m - 1; r >= 0; --r) {
    x[r] = x[r] * factor[r * m + r];
    for (int k = r + 1; k < m; ++k)
      x[r] -= factor[k * m + r] * x[k];
  }
}

} // namespace ffrobot::recursion
