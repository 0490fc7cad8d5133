// Solutions of A x = b and A^T y = c: those where A is square, which must be regular then; else of all that come
// closest the ones of least norm.
#pragma once

#include <Eigen/LU>
#include <Eigen/QR>

namespace ffrobot {

class LeastNorm {
public:
  void compute(const Eigen::MatrixXd &A) {
    is_square_ = A.rows() == A.cols();
    if (is_square_)
      lu_.compute(A);
    else
      qr_.setThreshold(dependent).compute(A);
  }
  template <class Columns> Columns solve(const Columns &b) const {
    if (is_square_)
      return lu_.solve(b);
    return qr_.solve(b);
  }
  Eigen::VectorXd solve_transposed(const Eigen::VectorXd &c) const {
    return is_square_ ? lu_.transpose().solve(c).eval() : qr_.transpose().solve(c).eval();
  }

private:
  static constexpr double dependent = 1e-10; // of the largest pivot: rounding leaves 1e-15 of dependent equations
  bool is_square_ = true;
  Eigen::PartialPivLU<Eigen::MatrixXd> lu_;
  Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> qr_;
};

} // namespace ffrobot
