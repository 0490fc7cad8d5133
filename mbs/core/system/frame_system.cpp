#include "core/system/frame_system.h"

#include <limits>

namespace ffrobot {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

constexpr Index largest_dense = 60; // coordinates: 20 links

} // namespace

FrameSystem::FrameSystem(Index bodies) : is_dense_(3 * bodies <= largest_dense) {
  const Index size = 3 * bodies;
  gradient_ = VectorXd::Zero(size);
  if (is_dense_) {
    dense_ = Eigen::MatrixXd::Zero(size, size);
    lu_ = Eigen::PartialPivLU<Eigen::MatrixXd>(size);
  } else
    columns_.resize(static_cast<std::size_t>(size));
}

void FrameSystem::set_column(Index column, const Measure &row, const MeasureMotion &motion,
                             const std::vector<PlanarBodyState> &bodies) {
  if (is_dense_) {
    dense_.col(column).setZero();
    add_frame_gradient(row, motion, bodies, dense_.col(column));
    return;
  }
  add_frame_gradient(row, motion, bodies, gradient_);
  auto &entries = columns_[static_cast<std::size_t>(column)];
  entries.clear();
  for (const auto *m : {&row.a, &row.b})
    for (Index i = 3 * m->body; m->body >= 0 && i < 3 * m->body + 3; ++i) {
      entries.emplace_back(i, column, gradient_[i]);
      gradient_[i] = 0; // a row may have both ends on one body
    }
}

void FrameSystem::factorise() {
  if (is_dense_) {
    lu_.compute(dense_);
    return;
  }
  std::vector<Eigen::Triplet<double>> entries;
  for (const auto &column : columns_)
    entries.insert(entries.end(), column.begin(), column.end());
  SparseMatrix matrix(gradient_.size(), gradient_.size());
  matrix.setFromTriplets(entries.begin(), entries.end());
  sparse_lu_ = std::make_shared<SparseLU>();
  sparse_lu_->compute(matrix);
}

VectorXd FrameSystem::solve(const VectorXd &b) const {
  if (is_dense_)
    return lu_.solve(b);
  if (sparse_lu_->info() != Eigen::Success)
    return VectorXd::Constant(b.size(), std::numeric_limits<double>::quiet_NaN());
  return sparse_lu_->solve(b);
}

} // namespace ffrobot
