// The matrix of Newton's method in implicit integrators, N = M + B^T E B under C_q; E is a diagonal, not zero at a few
// stiff coordinates of B x alone: modes, springs in joints, and joints at which loops are cut, whose rates are rows of
// B below the identity. What the tree cannot take (rows `extra` of B: those of cut joints, and springs of pins whose
// section modes turn) is told apart like a constraint that gives: with N_0 of the tree (newton_tree.h)
//     N x + C_q^T nu = B^T r, C_q x = c:     x = N_0^-1 (B^T r - C_q^T nu - B_e^T mu),   mu = E_e B_e x
#pragma once

#include "core/recursion/newton_tree.h"

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
    for (Eigen::Index r = 0; r < count; ++r)
      tree_.solve(response_.col(r).data());
    Matrix S = rows.template cast<Scalar>() * response_;
    S.bottomRows(extra).array().colwise() *= E_extra.array();
    S.diagonal().tail(extra).array() += Scalar(1);
    schur_.factorise(std::move(S));
  }

  // x (n_v): B^T r in, the solution out; c of the kept rows, or null for zero
  void solve(const Scalar *c, Scalar *x) {
    tree_.solve(x);
    const Eigen::Index count = rows_->rows(), extra = E_extra_.size(), kept = count - extra;
    if (count == 0)
      return;
    Eigen::Map<Vector> x_(x, rows_->cols());
    Vector nu = *rows_ * x_;
    if (c)
      nu.head(kept) -= Eigen::Map<const Vector>(c, kept);
    nu.tail(extra).array() *= E_extra_.array();
    schur_.solve(nu.data());
    x_.noalias() -= response_ * nu;
  }

private:
  NewtonTree<Space, Scalar> tree_;
  const Eigen::MatrixXd *rows_ = nullptr;
  Matrix response_; // (n_v, rows) N_0^-1 of them, transposed
  Vector E_extra_;
  Lu<Scalar> schur_;
};

} // namespace ffrobot::recursion
