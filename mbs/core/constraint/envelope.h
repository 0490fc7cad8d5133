// LDL^T of a symmetric matrix with nonzero pivots (positive definite, say) stored by row envelopes (lower triangle,
// from the first nonzero). Small ones are stored in full: a size that the compiler knows stays in registers.
#pragma once

#include <Eigen/Core>

#include <algorithm>
#include <concepts>
#include <vector>

namespace ffrobot {

// Scalar: double, or complex for a matrix that is symmetric (not Hermitian).
template <class Scalar> class EnvelopeMatrix {
public:
  EnvelopeMatrix() = default;

  // first[i] <= i: column of the first entry of row i that may be nonzero
  explicit EnvelopeMatrix(std::vector<Eigen::Index> first);

  Eigen::Index size() const { return static_cast<Eigen::Index>(first_.size()); }
  void set_zero();
  Eigen::Index place(Eigen::Index row, Eigen::Index column) const { // in entries(); column >= first[row]
    return start_[static_cast<std::size_t>(row)] + column;
  }
  Scalar *entries() { return rows_.data(); }
  Scalar *entry(Eigen::Index row, Eigen::Index column) { return entries() + place(row, column); }

  void factorise();            // in place; unpivoted
  void solve(Scalar *x) const; // after factorise; x: right-hand side in, solution out

private:
  std::vector<Eigen::Index> first_;
  std::vector<Eigen::Index> start_; // rows_[start_[i] + j] is entry (i, j)
  std::vector<Scalar> rows_;
  std::vector<Scalar> inverse_; // 1 / D
};

} // namespace ffrobot
