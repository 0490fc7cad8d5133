#include "core/linear/singular_values.h"

#include <Eigen/SVD>

#include <algorithm>

namespace ffrobot {

using Eigen::MatrixXd;

Eigen::VectorXd singular_values(const MatrixXd &A) { return Eigen::JacobiSVD<MatrixXd>(A).singularValues(); }

MatrixXd null_space(const MatrixXd &A, double dependent) {
  if (A.rows() == 0)
    return MatrixXd::Identity(A.cols(), A.cols());
  const Eigen::JacobiSVD<MatrixXd> svd(A, Eigen::ComputeFullV);
  const double least = dependent * std::max(svd.singularValues()[0], 1.0);
  const Eigen::Index rank = (svd.singularValues().array() > least).count();
  return svd.matrixV().rightCols(A.cols() - rank);
}

} // namespace ffrobot
