// Products of dynamic matrices as functions: Eigen's expressions of them are compiled once, in products.cpp, and not
// again for every kind of operand (half the time of a file that has ten).
#pragma once

#include "core/eigen.h"

namespace ffrobot {

using ConstMatrix = Ref<const MatrixXd>;

MatrixXd matrix_product(const ConstMatrix &A, const ConstMatrix &B); // A B

// To `to`: factor A^T B
void add_transposed_product(const ConstMatrix &A, const ConstMatrix &B, Ref<MatrixXd> to, double factor = 1);

} // namespace ffrobot
