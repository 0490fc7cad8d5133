#include "core/envelope.h"

#include <algorithm>
#include <complex>

namespace ffrobot {

using Eigen::Index;

template <class Scalar>
EnvelopeMatrix<Scalar>::EnvelopeMatrix(std::vector<Index> first)
    : first_(std::move(first)), start_(first_.size()), inverse_(first_.size()) {
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
