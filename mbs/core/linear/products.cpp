#include "core/linear/products.h"

namespace ffrobot {

using Eigen::MatrixXd;

MatrixXd matrix_product(const ConstMatrix &A, const ConstMatrix &B) { return A * B; }

void add_transposed_product(const ConstMatrix &A, const ConstMatrix &B, Eigen::Ref<MatrixXd> to, double factor) {
  to.noalias() += factor * A.transpose() * B;
}

} // namespace ffrobot
