#include "core/linear/lu.h"

#include "core/linear/square.h"

#include <utility>

namespace ffrobot {

using Eigen::Index;

namespace {

// y -= factor x, n numbers
template <class Scalar> void subtract(Scalar factor, const Scalar *x, Index n, Scalar *__restrict y) {
  for (Index i = 0; i < n; ++i)
    y[i] -= factor * x[i];
}

} // namespace

template <class Scalar> void Lu<Scalar>::factorise(Matrix A) {
  const Index n = A.rows();
  from_.resize(static_cast<std::size_t>(n));
  for (Index k = 0; k < n; ++k) {
    Scalar *column = &A(0, k);
    Index best = k;
    for (Index r = k + 1; r < n; ++r)
      if (size_of(column[r]) > size_of(column[best]))
        best = r;
    from_[static_cast<std::size_t>(k)] = best;
    if (best != k)
      for (Index c = 0; c < n; ++c)
        std::swap(A(k, c), A(best, c));
    const Scalar pivot = Scalar(1) / column[k];
    for (Index r = k + 1; r < n; ++r)
      column[r] *= pivot;
    for (Index c = k + 1; c < n; ++c)
      subtract(A(k, c), column + k + 1, n - k - 1, &A(k, c) + 1);
  }
  factors_ = std::move(A);
}

template <class Scalar> void Lu<Scalar>::solve(Scalar *x) const {
  const Index n = factors_.rows();
  for (Index k = 0; k < n; ++k)
    std::swap(x[k], x[from_[static_cast<std::size_t>(k)]]);
  for (Index k = 0; k < n; ++k)
    subtract(x[k], factors_.data() + n * k + k + 1, n - k - 1, x + k + 1);
  for (Index k = n; k-- > 0;) {
    x[k] /= factors_(k, k);
    subtract(x[k], factors_.data() + n * k, k, x);
  }
}

template <class Scalar> void Lu<Scalar>::solve_transposed(Scalar *x) const {
  const Index n = factors_.rows();
  for (Index k = 0; k < n; ++k) {
    for (Index r = 0; r < k; ++r)
      x[k] -= factors_(r, k) * x[r];
    x[k] /= factors_(k, k);
  }
  for (Index k = n; k-- > 0;)
    for (Index r = k + 1; r < n; ++r)
      x[k] -= factors_(r, k) * x[r];
  for (Index k = n; k-- > 0;)
    std::swap(x[k], x[from_[static_cast<std::size_t>(k)]]);
}

template <class Scalar> Scalar Lu<Scalar>::determinant() const {
  Scalar product = 1;
  for (Index k = 0; k < factors_.rows(); ++k)
    product *= from_[static_cast<std::size_t>(k)] == k ? factors_(k, k) : -factors_(k, k);
  return product;
}

template class Lu<double>;
template class Lu<std::complex<double>>;

} // namespace ffrobot
