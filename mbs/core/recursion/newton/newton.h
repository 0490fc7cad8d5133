// The matrix of Newton's method in implicit integrators, N = M + B^T E B under C_q; E is a diagonal, not zero at a few
// stiff coordinates of B x alone: modes, springs in joints, and joints at which loops are cut, whose rates are rows of
// B below the identity. What the tree cannot take (rows `extra` of B: those of cut joints, and springs of pins whose
// section modes turn) is told apart like a constraint that gives: with N_0 of the tree (newton_tree.h)
//     N x + C_q^T nu = B^T r, C_q x = c:     x = N_0^-1 (B^T r - C_q^T nu - B_e^T mu),   mu = E_e B_e x
#pragma once

#include "core/recursion/newton/newton_tree.h"

#include <vector>

namespace ffrobot::recursion {

template <class Space, class Scalar> class NewtonMatrix {
public:
  using Vector = Eigen::Matrix<Scalar, Eigen::Dynamic, 1>;
  using Matrix = Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>;

  // rows: those of C_q that are kept, then B_e (rows, n_v); E: that of the tree (n_v), and of B_e. `posture` and `rows`
  // must outlive this.
  void factorise(const NewtonPosture<Space> &posture, const Eigen::MatrixXd &rows, const Vector &E,
                 const Vector &E_extra) {
    rows_ = &rows, E_extra_ = E_extra;
    tree_.factorise(posture, E);
    const Eigen::Index count = rows.rows(), extra = E_extra.size();
    if (count == 0)
      return;
    response_ = rows.transpose().template cast<Scalar>();
    nu_.resize(count);
    Matrix S(count, count);
    for (Eigen::Index r = 0; r < count; ++r) {
      tree_.solve(&response_(0, r));
      along_rows(&response_(0, r), &S(0, r));
      S(r, r) += r < count - extra ? 0. : 1.;
    }
    schur_.factorise(std::move(S));
  }

  // x (n_v): B^T r in, the solution out; c of the kept constraints, or null for zero
  void solve(const Scalar *c, Scalar *x) {
    tree_.solve(x);
    const Eigen::Index count = rows_->rows(), kept = count - E_extra_.size();
    if (count == 0)
      return;
    along_rows(x, nu_.data());
    for (Eigen::Index r = 0; c && r < kept; ++r)
      nu_[r] -= c[r];
    schur_.solve(nu_.data());
    Eigen::Map<Vector> x_(x, rows_->cols());
    for (Eigen::Index r = 0; r < count; ++r)
      x_ -= nu_[r] * response_.col(r);
  }

private:
  // y (rows): C_q x, and E_e B_e x
  void along_rows(const Scalar *x, Scalar *y) const {
    const Eigen::Index count = rows_->rows(), kept = count - E_extra_.size();
    for (Eigen::Index r = 0; r < count; ++r) {
      Scalar sum(0);
      for (Eigen::Index i = 0; i < rows_->cols(); ++i)
        sum += (*rows_)(r, i) * x[i];
      y[r] = r < kept ? sum : E_extra_[r - kept] * sum;
    }
  }

  NewtonTree<Space, Scalar> tree_;
  const Eigen::MatrixXd *rows_ = nullptr;
  Matrix response_;     // (n_v, rows) N_0^-1 of them, transposed
  Vector E_extra_, nu_; // (rows) multipliers
  Lu<Scalar> schur_;
};

} // namespace ffrobot::recursion
