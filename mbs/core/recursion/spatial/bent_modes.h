// Modes whose mass matrix m_ff changes with p: those of bodies with geometric stiffening, in the plane and in space.
// What a linear body has as constants is found at every evaluation: with m_ff = L D L^T, W m_ff^-1 W^T of its rows
// W(p).
#pragma once

#include "core/recursion/numbers/multipliers.h"
#include "core/recursion/spatial/mode_matrix.h"

namespace ffrobot::recursion {

template <class T> struct BentModes {
  static constexpr int FORCE = 7; // a row that W has not: Q_f stands there
  BentModes(int modes, int row_count)
      : n(modes), width(row_count), rows(n * width, T(0.)), solved(rows), factor(n * n, T(0.)),
        curvature(width, T(0.)) {}

  int n, width;
  Aligned<T> rows;      // (n, width) W(p) transposed, with Q_f
  Aligned<T> solved;    // (n, width) L^-1 of these
  Aligned<T> factor;    // (n, n) L, with 1/D in the place of its diagonal
  Aligned<T> curvature; // (width) p_dot^T K p_dot of rows

  // With m_ff in the lower half of `factor`, and all rows
  void eliminate() {
    using Block = Pack<T, 8>;
    factorise(factor.data(), n);
    for (int i = 0; i < n; ++i)
      for (int block = 0; block < width; block += 8) {
        Block x = Block::read(rows.data() + i * width + block);
        for (int l = 0; l < i; ++l)
          x -= factor[i * n + l] * Block::read(solved.data() + l * width + block);
        x.write(solved.data() + i * width + block);
      }
  }

  // W m_ff^-1 W^T (width, width)
  void multiply(T *to) const {
    using Block = Pack<T, 8>;
    for (int block = 0; block < width; block += 8)
      for (int r = 0; r < width; ++r) {
        Block sum = Block::zero();
        for (int i = 0; i < n; ++i) {
          const T *x = solved.data() + i * width;
          sum += (factor[i * n + i] * x[r]) * Block::read(x + block);
        }
        sum.write(to + r * width + block);
      }
  }

  // p_ddot (n) = m_ff^-1 of forces z (width) along the rows, by multipliers without Q_f
  void accelerate(T *z, bool by_multipliers, T *a) const {
    using Block = Pack<T, 8>;
    z[FORCE] = T(by_multipliers ? 0. : 1.);
    for (int i = 0; i < n; ++i) {
      Block sum = Block::zero();
      for (int block = 0; block < width; block += 8)
        sum += Block::read(z + block) * Block::read(solved.data() + i * width + block);
      a[i] = factor[i * n + i] * sum.sum();
    }
    for (int i = n - 1; i > 0; --i)
      for (int l = 0; l < i; ++l)
        a[l] -= factor[i * n + l] * a[i];
  }

  // y = m_ff x
  void multiply_mass(const T *x, T *y) const {
    for (int i = 0; i < n; ++i) {
      y[i] = x[i];
      for (int l = i + 1; l < n; ++l)
        y[i] += factor[l * n + i] * x[l];
      y[i] = y[i] / factor[i * n + i];
    }
    for (int i = n - 1; i > 0; --i)
      for (int l = 0; l < i; ++l)
        y[i] += factor[i * n + l] * y[l];
  }
};

// W at p (width, n), of a state whose inertia is known
template <class Body, class State> Map<const MatrixXd> rows_of(const Body &b, const State &s) {
  return {b.stiffening ? s.bent.rows.data() : b.constant_rows(), b.row_count(), b.n};
}

} // namespace ffrobot::recursion
