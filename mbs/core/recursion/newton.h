// The matrix of Newton's method in implicit integrators, N = M + B^T E B under C_q; E is a diagonal, not zero at a few
// stiff coordinates s of B x alone: modes, springs in joints, and joints at which loops are cut, whose rates are rows
// of B below the identity.
//
// Under C_q forces r give accelerations P r, P = M^-1 - M^-1 C_q^T (C_q M^-1 C_q^T)^-1 C_q M^-1, of which the recursion
// finds a column an evaluation. With x_c, what moves the rows by c in the metric of M,
//     N x + C_q^T nu = B^T r, C_q x = c:   x = P B^T (r - E B x) + x_c,   (I + B_s P B_s^T E) x_s = B_s (P B^T r + x_c)
#pragma once

#include <Eigen/Core>
#include <Eigen/LU>

#include <vector>

namespace ffrobot::recursion {

template <class Scalar> class NewtonMatrix {
public:
  using Vector = Eigen::Matrix<Scalar, Eigen::Dynamic, 1>;
  using Matrix = Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>;

  // compliance: P B_s^T (n_v, stiff); coupling: the rows of B below the identity, transposed; E: its diagonal at s. All
  // but E must outlive this.
  void factorise(const Eigen::MatrixXd &compliance, const Eigen::MatrixXd &coupling,
                 const std::vector<Eigen::Index> &stiff, const Vector &E) {
    compliance_ = &compliance, coupling_ = &coupling, stiff_ = &stiff, E_ = E;
    compliance_s_ = at_stiff(compliance);
    const auto n = static_cast<Eigen::Index>(stiff.size());
    inverse_.compute(Matrix::Identity(n, n) + compliance_s_ * E.asDiagonal());
  }

  // r (of B x), not zero at s alone; x (n_v) in: x_c, out: the solution
  void solve(const Scalar *r, Scalar *x) const {
    const auto n = compliance_->rows();
    Eigen::Map<Vector> x_(x, n);
    const Vector force = Eigen::Map<const Vector>(r, n + coupling_->cols())(*stiff_);
    const Vector x_s = inverse_.solve(compliance_s_ * force + at_stiff(x_));
    x_ += *compliance_ * (force - E_.cwiseProduct(x_s));
  }

private:
  // B_s x of columns x
  template <class X> auto at_stiff(const X &x) const {
    using Columns = Eigen::Matrix<typename X::Scalar, Eigen::Dynamic, X::ColsAtCompileTime>;
    Columns y(x.rows() + coupling_->cols(), x.cols());
    y << x, coupling_->transpose() * x;
    return Columns(y(*stiff_, Eigen::all));
  }

  const Eigen::MatrixXd *compliance_ = nullptr, *coupling_ = nullptr;
  const std::vector<Eigen::Index> *stiff_ = nullptr;
  Eigen::MatrixXd compliance_s_; // B_s P B_s^T
  Vector E_;
  Eigen::PartialPivLU<Matrix> inverse_;
};

} // namespace ffrobot::recursion
