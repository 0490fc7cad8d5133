// P A = L U of a dense matrix of numbers that may be complex, in plain loops: for a few dozen rows, where products in
// blocks win nothing and would make up a good part of the compiled code.
#pragma once

#include <Eigen/Core>

#include <complex>
#include <vector>

namespace ffrobot {

template <class Scalar> class Lu {
public:
  using Matrix = Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>;

  // A (n, n), with the largest pivot of each column. A singular one gives results that are not finite.
  void factorise(Matrix A);

  // x (n): the right-hand side in, the solution out, of A x = b and of A^T x = b
  void solve(Scalar *x) const;
  void solve_transposed(Scalar *x) const;
  Scalar determinant() const;

private:
  Matrix factors_;                 // U, and L without its diagonal of ones
  std::vector<Eigen::Index> from_; // of each row: which one it was exchanged with
};

extern template class Lu<double>;
extern template class Lu<std::complex<double>>;

} // namespace ffrobot
