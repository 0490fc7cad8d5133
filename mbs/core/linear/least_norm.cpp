#include "core/linear/least_norm.h"

#include <Eigen/QR>

namespace ffrobot {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double dependent = 1e-10; // of the largest pivot: rounding leaves 1e-15 of dependent equations

} // namespace

void LeastNorm::compute(const MatrixXd &A) {
  is_square_ = A.rows() == A.cols();
  if (is_square_)
    return lu_.factorise(A);
  Eigen::CompleteOrthogonalDecomposition<MatrixXd> factors;
  pseudo_inverse_ = factors.setThreshold(dependent).compute(A).pseudoInverse();
}

MatrixXd LeastNorm::solve(const MatrixXd &b) const {
  if (!is_square_)
    return pseudo_inverse_ * b;
  MatrixXd x = b;
  for (auto column : x.colwise())
    lu_.solve(column.data());
  return x;
}

VectorXd LeastNorm::solve(const VectorXd &b) const {
  if (!is_square_)
    return pseudo_inverse_ * b;
  VectorXd x = b;
  lu_.solve(x.data());
  return x;
}

VectorXd LeastNorm::solve_transposed(const VectorXd &c) const {
  if (!is_square_)
    return pseudo_inverse_.transpose() * c;
  VectorXd x = c;
  lu_.solve_transposed(x.data());
  return x;
}

} // namespace ffrobot
