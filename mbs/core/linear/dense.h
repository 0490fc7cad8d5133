// Products, solutions and singular values of dense matrices as functions: Eigen's expressions are compiled once, in
// dense.cpp, and not again for every kind of operand (half the time of a file that has ten).
#pragma once

#include "core/eigen.h"

#include <Eigen/LU>

namespace ffrobot {

using ConstMatrix = Ref<const MatrixXd>;

MatrixXd matrix_product(const ConstMatrix &A, const ConstMatrix &B); // A B

// To `to`: factor A^T B
void add_transposed_product(const ConstMatrix &A, const ConstMatrix &B, Ref<MatrixXd> to, double factor = 1);

// Solutions of A x = b and A^T y = c: those where A is square, which must be regular then; else of all that come
// closest the ones of least norm.
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

// Singular values of A, descending, none without rows or columns, and its right singular vectors, square.
struct RightVectors {
  explicit RightVectors(const MatrixXd &A);

  // How many values are above `dependent` times the largest, which counts as 1 at least
  Index rank(double dependent) const;
  // Orthonormal columns that A takes to zero if its rank is that
  MatrixXd null_space(Index rank) const { return V.rightCols(V.cols() - rank); }
  double ratio(Index rank) const; // of value no. `rank` to the first; 1 of rank 0

  VectorXd values;
  MatrixXd V;
};

} // namespace ffrobot
