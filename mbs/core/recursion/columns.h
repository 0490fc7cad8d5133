// Columns side by side: what unit multipliers do beside what acts without constraints (column 0).
#pragma once

#include "core/recursion/workspace.h"

namespace ffrobot::recursion {

// How far columns lie apart in memory
constexpr int stride_of(int columns) { return static_cast<int>(std::bit_ceil(static_cast<unsigned>(columns))); }

// C M^-1 C^T as it is summed up: row r gains, or loses, a_r b. Column 0, what rows measure, grows along.
template <class Cols, int W> FFROBOT_INLINE void gain(Cols (&S)[W], const Cols &a, const Cols &b) {
#pragma GCC unroll 8
  for (int r = 1; r < W; ++r)
    S[r] += a[r] * b;
}
template <class Cols, int W> FFROBOT_INLINE void lose(Cols (&S)[W], const Cols &a, const Cols &b) {
#pragma GCC unroll 8
  for (int r = 1; r < W; ++r)
    S[r] -= a[r] * b;
}

// Of `count` pairs, one row of S after the other: that stays in a register
template <int count, class Cols, int W>
FFROBOT_INLINE void gain_all(Cols (&S)[W], const Cols (&a)[count], const Cols (&b)[count]) {
#pragma GCC unroll 8
  for (int r = 1; r < W; ++r) {
    Cols row = S[r];
    for (int i = 0; i < count; ++i)
      row += a[i][r] * b[i];
    S[r] = row;
  }
}

// y (Cols) = M x
template <int d, class T, class Cols> FFROBOT_INLINE void apply(const Pack<T, d> *M, const Cols *x, Cols *y) {
  for (int i = 0; i < d; ++i) {
    y[i] = M[i][0] * x[0];
    for (int j = 1; j < d; ++j)
      y[i] += M[i][j] * x[j];
  }
}

} // namespace ffrobot::recursion
