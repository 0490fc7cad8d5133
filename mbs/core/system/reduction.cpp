#include "core/system/reduction.h"

#include <stdexcept>
#include <string>

namespace ffrobot {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

Reduction::Reduction(const System &system, std::vector<Measure> independent)
    : system_(system), independent_(std::move(independent)), tangent_(system.n_v()),
      rows_(static_cast<Index>(3 * system.bodies.size()), system.n_v()) {
  for (std::size_t b = 0; b < system.bodies.size(); ++b)
    for (Index i = 0; i < system.bodies[b].coordinates(); ++i)
      (i < 3 ? frames_ : modes_).push_back(system.first_coordinate[b] + i);
  const std::size_t found = system.n_bilateral() + independent_.size();
  if (found != frames_.size())
    throw std::invalid_argument("expected " + std::to_string(frames_.size()) +
                                " constraints and independent rows, got " + std::to_string(found));
  const auto n = static_cast<Index>(frames_.size()), f = static_cast<Index>(independent_.size() + modes_.size());
  G_frames_.resize(n, n);
  G_modes_.resize(n, static_cast<Index>(modes_.size()));
  right_.resize(n, f);
  H = H_dot = H_ddot = MatrixXd::Zero(system.n_v(), f);
  for (std::size_t i = 0; i < modes_.size(); ++i)
    H(modes_[i], static_cast<Index>(independent_.size() + i)) = 1;
  lambda.resize(static_cast<Index>(system.n_bilateral()));
  force.resize(f);
}

void Reduction::scatter_frames(const MatrixXd &frames, MatrixXd &into) const {
  for (std::size_t i = 0; i < frames_.size(); ++i)
    into.row(frames_[i]) = frames.row(static_cast<Index>(i));
}

// With the gradients G of constraints and independent rows, G v = (0; s_dot) and, along the motion,
// G a + bias = (0; s_ddot): dq = H ds, dv = H ds_dot + H_dot ds, da = H ds_ddot + 2 H_dot ds_dot + H_ddot ds.
void Reduction::transform() {
  const Index m = lambda.size(), k = static_cast<Index>(independent_.size());
  for (std::size_t i = 0; i < frames_.size(); ++i)
    G_frames_.col(static_cast<Index>(i)) = rows_.by_acceleration.col(frames_[i]);
  for (std::size_t i = 0; i < modes_.size(); ++i)
    G_modes_.col(static_cast<Index>(i)) = rows_.by_acceleration.col(modes_[i]);
  lu_.compute(G_frames_);
  reciprocal_condition = lu_.rcond();
  right_.leftCols(k).setZero();
  right_.block(m, 0, k, k).setIdentity();
  right_.rightCols(G_modes_.cols()) = -G_modes_;
  scatter_frames(lu_.solve(right_), H);
  right_.noalias() = -0.5 * rows_.by_velocity * H;
  scatter_frames(lu_.solve(right_), H_dot);
  right_.noalias() = -rows_.by_velocity * H_dot;
  right_.noalias() -= rows_.by_position * H;
  scatter_frames(lu_.solve(right_), H_ddot);
}

void Reduction::reduce(double t, const double *q, const double *v, const double *a, Workspace &w) {
  tangent(system_, t, q, v, a, w, tangent_);
  const Index m = lambda.size();
  Index row = 0;
  for (std::size_t r = 0; r < system_.n_bilateral(); ++r)
    row_tangent(system_, system_.rows[r], q, v, a, w, row++, rows_);
  for (const auto &independent : independent_)
    row_tangent(system_, independent, q, v, a, w, row++, rows_);
  transform();

  // M a - Q = G^T (-lambda; forces along the rows) + modal forces
  VectorXd of_frames(row), of_modes(G_modes_.cols());
  for (std::size_t i = 0; i < frames_.size(); ++i)
    of_frames[static_cast<Index>(i)] = tangent_.force[frames_[i]];
  for (std::size_t i = 0; i < modes_.size(); ++i)
    of_modes[static_cast<Index>(i)] = tangent_.force[modes_[i]];
  const VectorXd along = lu_.transpose().solve(of_frames);
  lambda = -along.head(m);
  force << along.tail(row - m), of_modes - G_modes_.transpose() * along;
  for (Index r = 0; r < row; ++r) {
    const auto i = static_cast<std::size_t>(r);
    add_row_curvature(system_, r < m ? system_.rows[i] : independent_[i - static_cast<std::size_t>(m)], -along[r], w,
                      tangent_.K);
  }
  const MatrixXd HT = H.transpose(), M_H_dot = tangent_.M * H_dot;
  M.noalias() = HT * (tangent_.M * H);
  D.noalias() = HT * (tangent_.D * H + 2 * M_H_dot);
  K.noalias() = HT * (tangent_.K * H + tangent_.D * H_dot + tangent_.M * H_ddot);
}

} // namespace ffrobot
