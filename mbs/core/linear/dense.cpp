#include "core/linear/dense.h"

#include <Eigen/QR>
#include <Eigen/SVD>

#include <algorithm>

namespace ffrobot {

MatrixXd matrix_product(const ConstMatrix &A, const ConstMatrix &B) { return A * B; }

void add_transposed_product(const ConstMatrix &A, const ConstMatrix &B, Ref<MatrixXd> to, double factor) {
  to.noalias() += factor * A.transpose() * B;
}

namespace {

constexpr double dependent = 1e-10; // of the largest pivot: rounding leaves 1e-15 of dependent equations

} // namespace

void LeastNorm::compute(const MatrixXd &A, bool may_be_singular) {
  is_square_ = A.rows() == A.cols() && !may_be_singular;
  if (is_square_) {
    lu_.compute(A);
    return;
  }
  Eigen::CompleteOrthogonalDecomposition<MatrixXd> factors;
  pseudo_inverse_ = factors.setThreshold(dependent).compute(A).pseudoInverse();
}

MatrixXd LeastNorm::solve(const MatrixXd &b) const {
  return is_square_ ? MatrixXd(lu_.solve(b)) : MatrixXd(pseudo_inverse_ * b);
}

VectorXd LeastNorm::solve(const VectorXd &b) const {
  return is_square_ ? VectorXd(lu_.solve(b)) : VectorXd(pseudo_inverse_ * b);
}

VectorXd LeastNorm::solve_transposed(const VectorXd &c) const {
  return is_square_ ? VectorXd(lu_.transpose().solve(c)) : VectorXd(pseudo_inverse_.transpose() * c);
}

double determinant(const MatrixXd &A) { return A.determinant(); }

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
