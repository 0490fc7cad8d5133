#include "core/linear/singular_values.h"

#include <Eigen/SVD>

#include <algorithm>

namespace ffrobot {

RightVectors::RightVectors(const MatrixXd &A) : V(MatrixXd::Identity(A.cols(), A.cols())) {
  if (A.size() == 0)
    return;
  const Eigen::JacobiSVD<MatrixXd> svd(A, Eigen::ComputeFullV);
  values = svd.singularValues(), V = svd.matrixV();
}

Index RightVectors::rank(double dependent) const {
  return values.size() ? (values.array() > dependent * std::max(values[0], 1.0)).count() : 0;
}

double RightVectors::ratio(Index rank) const {
  if (rank == 0)
    return 1;
  return rank <= values.size() && values[0] > 0 ? values[rank - 1] / values[0] : 0;
}

} // namespace ffrobot
