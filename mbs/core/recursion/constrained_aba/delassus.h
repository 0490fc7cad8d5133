// Columns side by side: what unit multipliers do beside what acts without constraints (column 0).
#pragma once

#include "core/recursion/mechanism/workspace.h"

namespace ffrobot::recursion {

// How far columns lie apart in memory
constexpr int stride_of(int columns) { return static_cast<int>(std::bit_ceil(static_cast<unsigned>(columns))); }

// C M^-1 C^T as it is summed up, of the constraints of the block; column 0, what constraints measure, grows along.
// Where there are several blocks (blocks.h), what it is summed up of is kept, since products between blocks are made of
// it.
template <class T, int W> struct Delassus {
  static constexpr bool may_keep = W == most_columns;
  Pack<T, W> row[W];
  std::conditional_t<may_keep, Terms<T> *, std::nullptr_t> terms = nullptr;

  FFROBOT_INLINE Pack<T, W> &operator[](int r) { return row[r]; }
  FFROBOT_INLINE void keep(const Pack<T, W> &a, const Pack<T, W> &b) {
    if constexpr (may_keep)
      if (terms)
        terms->add(a, b);
  }
};

// Row r gains, or loses, a_r b.
template <class T, int W> FFROBOT_INLINE void add_dyad(Delassus<T, W> &S, const Pack<T, W> &a, const Pack<T, W> &b) {
  S.keep(a, b);
#pragma GCC unroll 8
  for (int r = 1; r < W; ++r)
    S[r] += a[r] * b;
}
template <class T, int W>
FFROBOT_INLINE void subtract_dyad(Delassus<T, W> &S, const Pack<T, W> &a, const Pack<T, W> &b) {
  S.keep(T(-1.) * a, b);
#pragma GCC unroll 8
  for (int r = 1; r < W; ++r)
    S[r] -= a[r] * b;
}

// Of `count` pairs, one row of S after the other: that stays in a register
template <int count, class T, int W>
FFROBOT_INLINE void subtract_dyads(Delassus<T, W> &S, const Pack<T, W> (&a)[count], const Pack<T, W> *b) {
  for (int i = 0; i < count; ++i)
    S.keep(T(-1.) * a[i], b[i]);
#pragma GCC unroll 8
  for (int r = 1; r < W; ++r) {
    Pack<T, W> row = S[r];
    for (int i = 0; i < count; ++i)
      row -= a[i][r] * b[i];
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
