// Matrices over the modes of a body, (n, n) and constant, kept as what they are: full, sparse or diagonal.
//
// Modes lie side by side in registers of eight: vectors over modes are padded with zeros to a multiple of that. Of
// other scalars than doubles (duals) each mode goes by itself.
#pragma once

#include "core/recursion/numbers/pack.h"

#include "core/eigen.h"

#include <algorithm>
#include <cstddef>
#include <type_traits>

namespace ffrobot::recursion {

constexpr double negligible = 1e-12; // of the largest of its kind: rounding

constexpr int lanes = 8; // that rows of six take in memory
constexpr int modes_at_once = 8;
constexpr int padded(int n) { return (n + modes_at_once - 1) / modes_at_once * modes_at_once; }
constexpr int even(int n) { return n + n % 2; } // columns of full matrices: products take two at once

template <class T> constexpr int step = std::is_same_v<T, double> ? modes_at_once : 1;
template <class T> using Modes = Pack<T, step<T>>; // of a vector over modes

// sum += factor row, `n` numbers of a constant row
template <int n, class T> FFROBOT_INLINE void add_scaled(const T &factor, const double *row, Pack<T, n> &sum) {
  if constexpr (std::is_same_v<T, double>)
    sum += factor * Pack<double, n>::read(row);
  else
    for (int i = 0; i < n; ++i)
      sum.x[i] += row[i] * factor;
}

// Constants as numbers that change
template <int n, class T> FFROBOT_INLINE Pack<T, n> constant_row(const double *x) {
  if constexpr (std::is_same_v<T, double>)
    return Pack<double, n>::read(x);
  else {
    Pack<T, n> to;
    for (int i = 0; i < n; ++i)
      to.x[i] = T(x[i]);
    return to;
  }
}
template <class T> FFROBOT_INLINE Modes<T> constants(const double *x) { return constant_row<step<T>, T>(x); }

// Those among them that there are, `left` from here on, to where nothing is padded
template <int n, class T> FFROBOT_INLINE void write_modes(const Pack<T, n> &x, int left, T *to) {
  if constexpr (n == modes_at_once)
    store_part(to, x.v, std::min(left, n));
  else
    to[0] = x[0];
}

// `act` with the number of modes as it is, or with that of the one or two registers that they take: loops over modes
// need no counting then
template <class T, class F> FFROBOT_INLINE void with_modes(int n, const F &act) {
  if constexpr (std::is_same_v<T, double>) {
    if (n <= modes_at_once)
      return act(std::integral_constant<int, modes_at_once>());
    if (n <= 2 * modes_at_once)
      return act(std::integral_constant<int, 2 * modes_at_once>());
  }
  act(std::integral_constant<int, 0>());
}

// n of them from where nothing is padded
template <class T> FFROBOT_INLINE void read_modes(const T *from, int n, T *to) {
  if constexpr (std::is_same_v<T, double>) {
    int k = 0;
    for (; k + modes_at_once <= n; k += modes_at_once)
      Eight::load(from + k).store(to + k);
    if (k < n)
      load_part(from + k, n - k).store(to + k);
  } else
    std::copy_n(from, n, to);
}

struct ModeMatrix {
  enum class Kind { zero, diagonal, sparse, full };
  ModeMatrix() = default;
  explicit ModeMatrix(const MatrixXd &M, double rounding = 0); // entries up to that count as zero

  Kind kind = Kind::zero;
  int n = 0;
  Aligned<double> values; // full: columns, padded; diagonal: padded; sparse: row after row
  std::vector<int> first; // sparse: of row i, first[i] … first[i + 1] - 1
  std::vector<int> column;
};

double largest_of(const std::vector<MatrixXd> &all); // entry of these, 0 of none

// What of K of a body's markers is nothing but rounding; K_s: its integral over the mass
template <class Data> double negligible_of(const Data &data, const std::vector<MatrixXd> &K_s) {
  double largest = largest_of(K_s) / data.mass; // the mean of all points
  for (const auto &marker : data.markers)
    largest = std::max(largest, largest_of(marker.K));
  return negligible * largest;
}

// Stiffness and damping of the modes of a body, which has K, D, is_damped and, for what is no diagonal, D_full
template <class Data, class Body> void take_damping(const Data &data, Body &body) {
  const MatrixXd &D = data.damping;
  body.K.assign(padded(body.n), 0.0), body.D = body.K;
  std::copy_n(data.stiffness.data(), body.n, body.K.begin());
  if (body.n == 0 || D.size() == 0 || D.isZero(0))
    return;
  body.is_damped = D.cols() == 1 || D.isDiagonal(0);
  if (!body.is_damped)
    body.D_full = D;
  else
    for (int k = 0; k < body.n; ++k)
      body.D[k] = D.cols() == 1 ? D(k, 0) : D(k, k);
}

// `blocks` registers of rows of y_c = M x_c, M full by columns `stride` apart, `even(n)` of them, for `count` vectors
// at once; `first`: of these rows
template <int blocks, int count, class T>
FFROBOT_INLINE void full_rows(const double *column, std::ptrdiff_t stride, int n, const T *const (&x)[count],
                              T *const (&y)[count], std::ptrdiff_t first) {
  Modes<T> sum[count][blocks];
  for (auto &of : sum)
    for (auto &block : of)
      block = Modes<T>::zero();
  column += first;
  for (std::ptrdiff_t k = 0; k < n; k += 2, column += 2 * stride)
    for (int c = 0; c < count; ++c)
      for (int i = 0; i < blocks; ++i) {
        add_scaled(x[c][k], column + i * step<T>, sum[c][i]);
        add_scaled(x[c][k + 1], column + stride + i * step<T>, sum[c][i]);
      }
  for (int c = 0; c < count; ++c)
    for (int i = 0; i < blocks; ++i)
      sum[c][i].write(y[c] + first + i * step<T>);
}
template <int count, class T>
FFROBOT_INLINE void full_product(const double *columns, int stride, int rows, int n, const T *const (&x)[count],
                                 T *const (&y)[count]) {
  std::ptrdiff_t first = 0;
  for (; first + step<T> < rows; first += 2 * step<T>)
    full_rows<2, count, T>(columns, stride, n, x, y, first);
  if (first < rows)
    full_rows<1, count, T>(columns, stride, n, x, y, first);
}

// y_c = M x_c, all padded; n: modes, padded or not
template <int count, class T>
FFROBOT_INLINE void multiply(const ModeMatrix &M, int n, const T *const (&x)[count], T *const (&y)[count]) {
  switch (M.kind) {
  case ModeMatrix::Kind::full:
    return full_product<count, T>(M.values.data(), padded(n), n, M.n, x, y);
  case ModeMatrix::Kind::diagonal:
    for (int i = 0; i < n; i += step<T>)
      for (int c = 0; c < count; ++c)
        (constants<T>(M.values.data() + i) * Modes<T>::read(x[c] + i)).write(y[c] + i);
    return;
  case ModeMatrix::Kind::sparse:
    for (int i = 0; i < M.n; ++i)
      for (int c = 0; c < count; ++c) {
        T sum(0.);
        for (int k = M.first[i]; k < M.first[i + 1]; ++k)
          sum += M.values[k] * x[c][M.column[k]];
        y[c][i] = sum;
      }
    return;
  case ModeMatrix::Kind::zero:
    for (int i = 0; i < n; i += step<T>)
      for (int c = 0; c < count; ++c)
        Modes<T>::zero().write(y[c] + i);
  }
}

// 1/2 p^T K p, p^T K v, v^T K v of a symmetric K
template <class T> struct Curve {
  T half, rate, bending;
};

// These, with p and v padded, as K_p and K_v become; K p leaves the row, whose numbers lie `stride` apart
template <class T>
FFROBOT_NOINLINE Curve<T> curve(const ModeMatrix &K, int n, const T *p, const T *v, T *K_p, T *K_v, T *row,
                                int stride) {
  if (K.kind == ModeMatrix::Kind::zero)
    return {T(0.), T(0.), T(0.)};
  multiply<2, T>(K, n, {p, v}, {K_p, K_v});
  Curve<T> to{T(0.), T(0.), T(0.)};
  for (int k = 0; k < n; ++k) {
    to.half += 0.5 * p[k] * K_p[k];
    to.rate += v[k] * K_p[k];
    to.bending += v[k] * K_v[k];
    row[k * stride] -= K_p[k];
  }
  return to;
}

} // namespace ffrobot::recursion
