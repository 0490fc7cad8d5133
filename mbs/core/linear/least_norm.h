// Solutions of A x = b and A^T y = c: those where A is square, which must be regular then; else of all that come
// closest the ones of least norm.
#pragma once

#include <Eigen/LU>

namespace ffrobot {

class LeastNorm {
public:
  void compute(const Eigen::MatrixXd &A, bool may_be_singular = false); // a square one
  Eigen::VectorXd solve(const Eigen::VectorXd &b) const;
  Eigen::MatrixXd solve(const Eigen::MatrixXd &b) const; // column by column
  Eigen::VectorXd solve_transposed(const Eigen::VectorXd &c) const;

private:
  bool is_square_ = true;
  Eigen::PartialPivLU<Eigen::MatrixXd> lu_;
  Eigen::MatrixXd pseudo_inverse_; // where A is not square
};

// Of a square matrix
double determinant(const Eigen::MatrixXd &A);

} // namespace ffrobot
