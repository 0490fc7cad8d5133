#include "core/envelope.h"

#include <algorithm>

namespace ffrobot {

using Eigen::Index;

EnvelopeMatrix::EnvelopeMatrix(std::vector<Index> first)
    : first_(std::move(first)), start_(first_.size()), inverse_(first_.size()) {
  Index used = 0;
  for (std::size_t i = 0; i < first_.size(); ++i) {
    start_[i] = used - first_[i];
    used += static_cast<Index>(i) - first_[i] + 1;
  }
  rows_.resize(static_cast<std::size_t>(used));
}

void EnvelopeMatrix::set_zero() { std::fill(rows_.begin(), rows_.end(), 0.0); }

void EnvelopeMatrix::factorise() {
  const Index n = size();
  const Index *first = first_.data(), *start = start_.data();
  for (Index i = 0; i < n; ++i) {
    double *row_i = rows_.data() + start[i];
    // first row_i[j] = L_ij D_j, then L_ij
    for (Index j = first[i]; j < i; ++j) {
      const double *row_j = rows_.data() + start[j];
      double sum = row_i[j];
      for (Index k = std::max(first[i], first[j]); k < j; ++k)
        sum -= row_i[k] * row_j[k];
      row_i[j] = sum;
    }
    double d = row_i[i];
    for (Index j = first[i]; j < i; ++j) {
      const double l = row_i[j] * inverse_[static_cast<std::size_t>(j)];
      d -= l * row_i[j];
      row_i[j] = l;
    }
    row_i[i] = d;
    inverse_[static_cast<std::size_t>(i)] = 1 / d;
  }
}

void EnvelopeMatrix::solve(double *x) const {
  const Index n = size();
  const Index *first = first_.data(), *start = start_.data();
  for (Index i = 0; i < n; ++i) {
    const double *row = rows_.data() + start[i];
    double sum = x[i];
    for (Index j = first[i]; j < i; ++j)
      sum -= row[j] * x[j];
    x[i] = sum;
  }
  for (Index i = 0; i < n; ++i)
    x[i] *= inverse_[static_cast<std::size_t>(i)];
  for (Index i = n - 1; i >= 0; --i) {
    const double *row = rows_.data() + start[i];
    const double xi = x[i];
    for (Index j = first[i]; j < i; ++j)
      x[j] -= row[j] * xi;
  }
}

} // namespace ffrobot
