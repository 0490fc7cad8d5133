#include "core/analysis/motors_on_tree.h"

namespace ffrobot {

using Eigen::Index;
using Eigen::VectorXd;

MotorsOnTree::MotorsOnTree(const SystemOnTree &both)
    : both_(both), forces_(both.tree), lambda_(VectorXd::Zero(static_cast<Index>(both.tree.rows.size()))),
      tau_(VectorXd::Zero(static_cast<Index>(both.reactions.motors.size()))), Q_(VectorXd::Zero(both.tree.n_v)),
      modal_force_(both.system.bodies.size()) {
  for (const auto &row : both.reactions.rows)
    if (!row.is_trajectory)
      cuts_.push_back(row.row);
  for (const auto &node : both.tree.nodes)
    for (int k = 0; k < node.shape.v_count; ++k)
      joint_coordinates_.push_back(node.v + k);
  cut_columns_.resize(both.tree.n_v, static_cast<Index>(cuts_.size()));
}

void MotorsOnTree::project(const double *q, const TreeWorkspace &w, Eigen::Ref<VectorXd> Q) {
  forces_.load(lambda_.data(), nullptr, w);
  forces_.project(q, w, Q.data());
  for (std::size_t r = 0; r < both_.tree.rows.size(); ++r)
    if (const recursion::Row &row = both_.tree.rows[r]; row.node >= 0)
      Q[both_.tree.nodes[static_cast<std::size_t>(row.node)].v + row.freedom] -= lambda_[static_cast<Index>(r)];
}

void MotorsOnTree::resolve(const double *q, const double *lambda, const TreeWorkspace &w) {
  lambda_ = Eigen::Map<const VectorXd>(lambda, lambda_.size());
  for (const int row : cuts_)
    lambda_[row] = 0;
  project(q, w, Q_);
  if (!cuts_.empty())
    close_loops(q, w);
  for (std::size_t k = 0; k < both_.reactions.motors.size(); ++k) {
    const auto &[coordinate, sign, on_modes] = both_.reactions.motors[k];
    const double tau = tau_[static_cast<Index>(k)] = sign * Q_[coordinate];
    if (on_modes.size() > 0)
      Q_ -= tau * on_modes;
  }
  for (std::size_t b = 0; b < modal_force_.size(); ++b)
    modal_force_[b] = Q_.segment(both_.drives.modes[b], both_.system.bodies[b].modes());
}

// Takes what the cuts do off Q, so that nothing is left of it along joint coordinates without a motor.
void MotorsOnTree::close_loops(const double *q, const TreeWorkspace &w) {
  const auto cuts = static_cast<Index>(cuts_.size()), size = cuts + tau_.size();
  Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(both_.tree.n_v, size);
  for (Index k = 0; k < cuts; ++k) {
    lambda_.setZero();
    lambda_[cuts_[static_cast<std::size_t>(k)]] = 1;
    project(q, w, cut_columns_.col(k));
    columns.col(k) = cut_columns_.col(k);
  }
  for (Index k = 0; k < tau_.size(); ++k) {
    const auto &motor = both_.reactions.motors[static_cast<std::size_t>(k)];
    columns(motor.coordinate, cuts + k) = motor.sign;
  }
  lu_.compute(columns(joint_coordinates_, Eigen::all));
  Q_ -= cut_columns_ * lu_.solve(Q_(joint_coordinates_)).head(cuts);
}

} // namespace ffrobot
