#include "core/linear/products.h"

namespace ffrobot {

MatrixXd matrix_product(const ConstMatrix &A, const ConstMatrix &B) { return A * B; }

void add_transposed_product(const ConstMatrix &A, const ConstMatrix &B, Ref<MatrixXd> to, double factor) {
  to.noalias() += factor * A.transpose() * B;
}

} // namespace ffrobot
