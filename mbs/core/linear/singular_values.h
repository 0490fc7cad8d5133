// Singular values of dense matrices, and what a matrix takes to zero.
#pragma once

#include <Eigen/Core>

namespace ffrobot {

Eigen::VectorXd singular_values(const Eigen::MatrixXd &A); // descending; none without rows or columns

// Orthonormal columns that A takes to zero: singular values below `dependent` times the largest, which counts as 1 at
// least, are zero.
Eigen::MatrixXd null_space(const Eigen::MatrixXd &A, double dependent);

} // namespace ffrobot
