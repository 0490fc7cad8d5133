#include "core/linear/least_norm.h"

namespace ffrobot {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double dependent = 1e-10; // of the largest pivot: rounding leaves 1e-15 of dependent equations

} // namespace

void LeastNorm::compute(const MatrixXd &A) {
  is_square_ = A.rows() == A.cols();
  if (is_square_)
    lu_.compute(A);
  else
    qr_.setThreshold(dependent).compute(A);
}

VectorXd LeastNorm::solve(const VectorXd &b) const {
  if (is_square_)
    return lu_.solve(b);
  return qr_.solve(b);
}

MatrixXd LeastNorm::solve(const MatrixXd &b) const {
  if (is_square_)
    return lu_.solve(b);
  return qr_.solve(b);
}

VectorXd LeastNorm::solve_transposed(const VectorXd &c) const {
  if (is_square_)
    return lu_.transpose().solve(c);
  return qr_.transpose().solve(c);
}

} // namespace ffrobot
