#include "core/linear/symmetric_factors.h"

#include <algorithm>

namespace ffrobot {

namespace {

// Loses x a (n). Eigen's expression takes longer where n is small.
template <class Scalar> void subtract(Scalar x, const Scalar *a, Scalar *from, Index n) {
  for (Index i = 0; i < n; ++i)
    from[i] -= x * a[i];
}

} // namespace

// Columns in panels: what a panel does to the columns behind it is one product of matrices.
template <class Scalar> void factorise_symmetric(Matrix<Scalar, Dynamic, Dynamic> &A) {
  constexpr Index most = 16;
  const Index n = A.rows();
  for (Index first = 0; first < n; first += most) {
    const Index end = std::min(first + most, n), rest = n - end;
    for (Index j = first; j < end; ++j) { // column j: L D
      A(j, j) = Scalar(1) / A(j, j);
      for (Index c = j + 1; c < end; ++c)
        subtract(A(c, j) * A(j, j), A.col(j).data() + c, A.col(c).data() + c, n - c);
    }
    const auto panel = A.block(end, first, rest, end - first);
    const Matrix<Scalar, Dynamic, Dynamic> L_D = panel;
    for (Index j = first; j < end; ++j)
      A.col(j).tail(n - j - 1) *= A(j, j);
    if (rest > 0)
      A.bottomRightCorner(rest, rest).template triangularView<Eigen::Lower>() -= L_D * panel.transpose();
  }
}

template <class Scalar>
void solve_symmetric(const Matrix<Scalar, Dynamic, Dynamic> &factors, Matrix<Scalar, Dynamic, 1> &x) {
  const Index n = x.size();
  for (Index j = 0; j < n; ++j)
    subtract(x[j], factors.col(j).data() + j + 1, x.data() + j + 1, n - j - 1);
  for (Index j = n; j-- > 0;)
    x[j] = x[j] * factors(j, j) - factors.col(j).tail(n - j - 1).cwiseProduct(x.tail(n - j - 1)).sum();
}

template void factorise_symmetric(MatrixXd &);
template void factorise_symmetric(Eigen::MatrixXcd &);
template void solve_symmetric(const MatrixXd &, VectorXd &);
template void solve_symmetric(const Eigen::MatrixXcd &, VectorXcd &);

} // namespace ffrobot
