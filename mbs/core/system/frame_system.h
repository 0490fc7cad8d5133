// The square system of the frames' coordinates: columns are (R, theta) parts of the gradients of rows, as many as
// bodies have frame coordinates. Large ones are sparse, each column meets two bodies: factorised in time linear in the
// links of a chain.
#pragma once

#include "core/constraint/measure.h"

#include <Eigen/LU>
#include <Eigen/SparseLU>

#include <memory>
#include <vector>

namespace ffrobot {

class FrameSystem {
public:
  explicit FrameSystem(Eigen::Index bodies);

  void set_column(Eigen::Index column, const Measure &row, const MeasureMotion &motion,
                  const std::vector<PlanarBodyState> &bodies);
  void factorise();

  // x of (columns) x = b; NaN where the system is singular
  Eigen::VectorXd solve(const Eigen::VectorXd &b) const;

private:
  using SparseMatrix = Eigen::SparseMatrix<double>;
  using SparseLU = Eigen::SparseLU<SparseMatrix>;

  bool is_dense_;
  Eigen::VectorXd gradient_;
  Eigen::MatrixXd dense_;
  Eigen::PartialPivLU<Eigen::MatrixXd> lu_;
  std::vector<std::vector<Eigen::Triplet<double>>> columns_;
  std::shared_ptr<SparseLU> sparse_lu_; // replaced, never changed: copies may share it
};

} // namespace ffrobot
