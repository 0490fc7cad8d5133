#include "core/linear/least_norm.h"

#include <Eigen/QR>

namespace ffrobot {

namespace {

constexpr double dependent = 1e-10; // of the largest pivot: rounding leaves 1e-15 of dependent equations

} // namespace

void LeastNorm::compute(const MatrixXd &A, bool may_be_singular) {
  is_square_ = A.rows() == A.cols() && !may_be_singular;
  if (is_square_) {
    lu_.compute(A);
    return;
  }
  Eigen::CompleteOrthogonalDecomposition<MatrixXd> factors;
  pseudo_inverse_ = factors.setThreshold(dependent).compute(A).pseudoInverse();
}

MatrixXd LeastNorm::solve(const MatrixXd &b) const {
  return is_square_ ? MatrixXd(lu_.solve(b)) : MatrixXd(pseudo_inverse_ * b);
}

VectorXd LeastNorm::solve(const VectorXd &b) const {
  return is_square_ ? VectorXd(lu_.solve(b)) : VectorXd(pseudo_inverse_ * b);
}

VectorXd LeastNorm::solve_transposed(const VectorXd &c) const {
  return is_square_ ? VectorXd(lu_.transpose().solve(c)) : VectorXd(pseudo_inverse_.transpose() * c);
}

double determinant(const MatrixXd &A) { return A.determinant(); }

} // namespace ffrobot
