#include "core/recursion/spatial/mode_matrix.h"

namespace ffrobot::recursion {

// Full where its columns, three instructions for eight entries, cost less than its entries one by one, five for each
// and five for a row.
ModeMatrix::ModeMatrix(const MatrixXd &given, double rounding) : n(static_cast<int>(given.rows())) {
  const MatrixXd M = (given.array().abs() > rounding).select(given, 0.0);
  const int filled = (M.array() != 0).count();
  if (filled == 0)
    return;
  if (M.isDiagonal(0)) {
    kind = Kind::diagonal;
    values.assign(padded(n), 0.0);
    for (int i = 0; i < n; ++i)
      values[i] = M(i, i);
    return;
  }
  kind = 5 * (filled + n) < 3 * n * padded(n) / modes_at_once ? Kind::sparse : Kind::full;
  if (kind == Kind::full) {
    values.assign(even(n) * padded(n), 0.0);
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i)
        values[j * padded(n) + i] = M(i, j);
    return;
  }
  for (int i = 0; i < n; ++i) {
    first.push_back(static_cast<int>(column.size()));
    for (int j = 0; j < n; ++j)
      if (M(i, j) != 0)
        column.push_back(j), values.push_back(M(i, j));
  }
  first.push_back(static_cast<int>(column.size()));
}

double largest_of(const std::vector<MatrixXd> &all) {
  double largest = 0;
  for (const MatrixXd &K : all)
    largest = std::max(largest, K.size() ? K.cwiseAbs().maxCoeff() : 0.0);
  return largest;
}

} // namespace ffrobot::recursion
