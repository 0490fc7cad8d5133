// Solutions of A x = b and A^T y = c: those where A is square, which must be regular then; else of all that come
// closest the ones of least norm.
#pragma once

#include <Eigen/LU>

namespace ffrobot {

class LeastNorm {
public:
  void compute(const MatrixXd &A, bool may_be_singular = false); // a square one
  VectorXd solve(const VectorXd &b) const;
  MatrixXd solve(const MatrixXd &b) const; // column by column
  VectorXd solve_transposed(const VectorXd &c) const;

private:
  bool is_square_ = true;
  Eigen::PartialPivLU<MatrixXd> lu_;
  MatrixXd pseudo_inverse_; // where A is not square
};

// Of a square matrix
double determinant(const MatrixXd &A);

} // namespace ffrobot
