// Singular values of dense matrices, and what a matrix takes to zero.
#pragma once

#include "core/eigen.h"

namespace ffrobot {

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
