#include "core/constraint/envelope.h"

#include <algorithm>
#include <complex>
#include <utility>

namespace ffrobot {

using Eigen::Index;

namespace {

constexpr Index largest_small = 8;

// Full lower triangle, by rows
template <class Scalar> constexpr Scalar &at(Scalar *rows, int i, int j) { return rows[i * (i + 1) / 2 + j]; }

template <int N, class Scalar> void factorise_small(Scalar *__restrict A, Scalar *__restrict inverse) {
#pragma GCC unroll 8
  for (int k = 0; k < N; ++k) {
    const Scalar d = Scalar(1) / at(A, k, k);
#pragma GCC unroll 8
    for (int i = k + 1; i < N; ++i)
#pragma GCC unroll 8
      for (int j = k + 1; j <= i; ++j)
        at(A, i, j) -= d * (at(A, i, k) * at(A, j, k)); // one product and one sum behind d: the next pivot waits
#pragma GCC unroll 8
    for (int i = k + 1; i < N; ++i)
      at(A, i, k) *= d;
    inverse[k] = d;
  }
}

template <int N, class Scalar> void solve_small(const Scalar *rows, const Scalar *inverse, Scalar *__restrict y) {
#pragma GCC unroll 8
  for (int i = 0; i < N; ++i)
#pragma GCC unroll 8
    for (int j = 0; j < i; ++j)
      y[i] -= at(rows, i, j) * y[j];
#pragma GCC unroll 8
  for (int i = 0; i < N; ++i)
    y[i] *= inverse[i];
#pragma GCC unroll 8
  for (int i = N - 1; i >= 0; --i)
#pragma GCC unroll 8
    for (int j = 0; j < i; ++j)
      y[j] -= at(rows, i, j) * y[i];
}

// Calls f.operator()<n>(), n up to largest_small.
template <class Function> void with_size(Index n, const Function &f) {
  [&]<int... i>(std::integer_sequence<int, i...>) {
    ((n == i + 1 ? f.template operator()<i + 1>() : void()), ...);
  }(std::make_integer_sequence<int, largest_small>());
}

} // namespace

template <class Scalar>
EnvelopeMatrix<Scalar>::EnvelopeMatrix(std::vector<Index> first)
    : first_(std::move(first)), start_(first_.size()), inverse_(first_.size()) {
  if (size() <= largest_small)
    std::fill(first_.begin(), first_.end(), 0);
  Index used = 0;
  for (std::size_t i = 0; i < first_.size(); ++i) {
    start_[i] = used - first_[i];
    used += static_cast<Index>(i) - first_[i] + 1;
  }
  rows_.resize(static_cast<std::size_t>(used));
}

template <class Scalar> void EnvelopeMatrix<Scalar>::set_zero() { std::fill(rows_.begin(), rows_.end(), Scalar(0)); }

template <class Scalar> void EnvelopeMatrix<Scalar>::factorise() {
  const Index n = size();
  if (n <= largest_small)
    return with_size(n, [&]<int N>() { factorise_small<N>(rows_.data(), inverse_.data()); });
  const Index *first = first_.data(), *start = start_.data();
  for (Index i = 0; i < n; ++i) {
    Scalar *row_i = rows_.data() + start[i];
    // first row_i[j] = L_ij D_j, then L_ij
    for (Index j = first[i]; j < i; ++j) {
      const Scalar *row_j = rows_.data() + start[j];
      Scalar sum = row_i[j];
      for (Index k = std::max(first[i], first[j]); k < j; ++k)
        sum -= row_i[k] * row_j[k];
      row_i[j] = sum;
    }
    Scalar d = row_i[i];
    for (Index j = first[i]; j < i; ++j) {
      const Scalar l = row_i[j] * inverse_[static_cast<std::size_t>(j)];
      d -= l * row_i[j];
      row_i[j] = l;
    }
    row_i[i] = d;
    inverse_[static_cast<std::size_t>(i)] = Scalar(1) / d;
  }
}

template <class Scalar> void EnvelopeMatrix<Scalar>::solve(Scalar *x) const {
  const Index n = size();
  if (n <= largest_small)
    return with_size(n, [&]<int N>() { solve_small<N>(rows_.data(), inverse_.data(), x); });
  const Index *first = first_.data(), *start = start_.data();
  for (Index i = 0; i < n; ++i) {
    const Scalar *row = rows_.data() + start[i];
    Scalar sum = x[i];
    for (Index j = first[i]; j < i; ++j)
      sum -= row[j] * x[j];
    x[i] = sum;
  }
  for (Index i = 0; i < n; ++i)
    x[i] *= inverse_[static_cast<std::size_t>(i)];
  for (Index i = n - 1; i >= 0; --i) {
    const Scalar *row = rows_.data() + start[i];
    const Scalar xi = x[i];
    for (Index j = first[i]; j < i; ++j)
      x[j] -= row[j] * xi;
  }
}

template class EnvelopeMatrix<double>;
template class EnvelopeMatrix<std::complex<double>>;

} // namespace ffrobot
