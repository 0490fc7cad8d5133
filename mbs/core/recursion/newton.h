// The matrix of Newton's method in implicit integrators, N = M + E under C_q; E is a diagonal, not zero at a few stiff
// coordinates s alone: modes, springs in joints.
//
// Under C_q forces r give accelerations P r, P = M^-1 - M^-1 C_q^T (C_q M^-1 C_q^T)^-1 C_q M^-1, of which the recursion
// finds a column an evaluation. With x_c, what moves the rows by c in the metric of M,
//     N x + C_q^T nu = r, C_q x = c:   x = P (r - E x) + x_c,   (I + P_ss E) x_s = (P r + x_c)_s
#pragma once

#include <Eigen/Core>
#include <Eigen/LU>

#include <vector>

namespace ffrobot::recursion {

template <class Scalar> class NewtonMatrix {
public:
  using Vector = Eigen::Matrix<Scalar, Eigen::Dynamic, 1>;
  using Matrix = Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>;

  // compliance: columns s of P (n_v, stiff); E: its diagonal at s. `compliance` and `stiff` must outlive this.
  void factorise(const Eigen::MatrixXd &compliance, const std::vector<Eigen::Index> &stiff, const Vector &E) {
    compliance_ = &compliance, stiff_ = &stiff, E_ = E;
    const auto n = static_cast<Eigen::Index>(stiff.size());
    inverse_.compute(Matrix::Identity(n, n) + (compliance(stiff, Eigen::all) * E.asDiagonal()));
  }

  // r (n_v), not zero at s alone; x (n_v) in: x_c, out: the solution
  void solve(const Scalar *r, Scalar *x) const {
    const auto n = compliance_->rows();
    Eigen::Map<Vector> x_(x, n);
    const Vector force = Eigen::Map<const Vector>(r, n)(*stiff_);
    const Vector x_s = inverse_.solve((*compliance_)(*stiff_, Eigen::all) * force + x_(*stiff_));
    x_ += *compliance_ * (force - E_.cwiseProduct(x_s));
  }

private:
  const Eigen::MatrixXd *compliance_ = nullptr;
  const std::vector<Eigen::Index> *stiff_ = nullptr;
  Vector E_;
  Eigen::PartialPivLU<Matrix> inverse_;
};

} // namespace ffrobot::recursion
