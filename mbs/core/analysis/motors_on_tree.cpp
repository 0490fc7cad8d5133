#include "core/analysis/motors_on_tree.h"

#include "core/recursion/planar/bent.h"

namespace ffrobot {

using Eigen::Index;
using Eigen::VectorXd;
namespace planar = recursion::planar;

MotorsOnTree::MotorsOnTree(const SystemOnTree &both)
    : both_(both), forces_(both.tree), lambda_(VectorXd::Zero(static_cast<Index>(both.tree.rows.size()))),
      tau_(VectorXd::Zero(static_cast<Index>(both.reactions.motors.size()))), Q_(VectorXd::Zero(both.tree.n_v)),
      modal_force_(both.system.bodies.size()) {
  std::vector<bool> is_trajectory(both.tree.rows.size(), false);
  for (const auto &row : both.reactions.rows)
    is_trajectory[static_cast<std::size_t>(row.row)] = row.is_trajectory;
  for (std::size_t r = 0; r < is_trajectory.size(); ++r)
    if (!is_trajectory[r])
      cuts_.push_back(static_cast<int>(r));
  for (const auto &node : both.tree.nodes)
    for (int k = 0; k < node.shape.v_count; ++k)
      joint_coordinates_.push_back(node.v + k);
  columns_.resize(both.tree.n_v, static_cast<Index>(cuts_.size()) + tau_.size());
  for (const auto &motor : both.reactions.motors)
    is_along_coordinates_ = is_along_coordinates_ && motor.cut < 0;
}

std::vector<bool> MotorsOnTree::are_moments() const {
  std::vector<bool> found;
  for (const auto &motor : both_.reactions.motors) {
    if (motor.cut >= 0)
      found.push_back(both_.scene.cut_joints[static_cast<std::size_t>(motor.cut)].turns);
    for (const auto &node : both_.tree.nodes)
      if (const int k = motor.coordinate - node.v; k >= 0 && k < node.shape.freedoms.count)
        found.push_back(node.shape.freedoms.component[k] >= recursion::Planar::linear);
  }
  return found;
}

const VectorXd &MotorsOnTree::find(const double *q, const TreeWorkspace &w) {
  resolve(q, w.lambda.data(), w);
  return tau_;
}

void MotorsOnTree::project(const double *q, const TreeWorkspace &w, Eigen::Ref<VectorXd> Q) {
  forces_.load(lambda_.data(), nullptr, w);
  forces_.project(q, w, Q.data());
}

void MotorsOnTree::resolve(const double *q, const double *lambda, const TreeWorkspace &w) {
  lambda_ = Eigen::Map<const VectorXd>(lambda, lambda_.size());
  for (const int row : cuts_)
    lambda_[row] = 0;
  project(q, w, Q_);
  if (!cuts_.empty() || !is_along_coordinates_)
    close_loops(q, w);
  for (std::size_t k = 0; k < both_.reactions.motors.size(); ++k) {
    const auto &[coordinate, sign, turns_frames, cut] = both_.reactions.motors[k];
    if (cut >= 0)
      continue;
    const double along = Q_[coordinate];
    tau_[static_cast<Index>(k)] = sign * along;
    if (turns_frames)
      turn_frames(coordinate, along, w);
  }
  for (std::size_t b = 0; b < modal_force_.size(); ++b)
    modal_force_[b] = Q_.segment(both_.drives.modes[b], both_.system.bodies[b].modes());
}

// Of a moment between the frames of bodies in place of their sections: what it does less on modes, F_p does more.
void MotorsOnTree::turn_frames(int coordinate, double moment, const TreeWorkspace &w) {
  const auto &nodes = both_.tree.nodes;
  const auto add = [&](std::size_t i, int row, double size) { // of the section's turn, in W
    const auto &node = nodes[i];
    Q_.segment(node.p_v(), node.n()) += size * planar::rows_of(node.body, w.bodies[i]).row(row).transpose();
  };
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const auto &node = nodes[i];
    if (coordinate < node.v || coordinate >= node.p_v())
      continue;
    if (node.inboard >= 0)
      add(i, node.body.ports[static_cast<std::size_t>(node.inboard)].row + 2, moment);
    else if (node.body.is_tilted)
      add(i, planar::Body::TILT, moment);
    if (node.parent < 0)
      return;
    const auto inner = static_cast<std::size_t>(node.parent);
    const auto port = static_cast<std::size_t>(node.parent_port - nodes[inner].first_port);
    add(inner, nodes[inner].body.ports[port].row + 2, -moment);
  }
}

// Takes off Q what the cuts do, and motors along cut joints, so that nothing is left of it along joint coordinates
// without a motor.
void MotorsOnTree::close_loops(const double *q, const TreeWorkspace &w) {
  const auto cuts = static_cast<Index>(cuts_.size());
  for (Index k = 0; k < cuts; ++k) {
    lambda_.setZero();
    lambda_[cuts_[static_cast<std::size_t>(k)]] = 1;
    project(q, w, columns_.col(k));
  }
  for (Index k = 0; k < tau_.size(); ++k)
    add_motor(k, q, w);
  lu_.compute(columns_(joint_coordinates_, Eigen::all));
  const VectorXd found = lu_.solve(Q_(joint_coordinates_));
  Q_ -= columns_.leftCols(cuts) * found.head(cuts);
  for (Index k = 0; k < tau_.size(); ++k)
    if (both_.reactions.motors[static_cast<std::size_t>(k)].cut >= 0) {
      tau_[k] = found[cuts + k];
      Q_ -= tau_[k] * columns_.col(cuts + k);
    }
}

void MotorsOnTree::add_motor(Index k, const double *q, const TreeWorkspace &w) {
  const auto &motor = both_.reactions.motors[static_cast<std::size_t>(k)];
  auto column = columns_.col(static_cast<Index>(cuts_.size()) + k);
  if (motor.cut < 0) {
    column.setZero();
    column[motor.coordinate] = motor.sign;
    return;
  }
  const std::vector<recursion::CutJoint> joint{both_.scene.cut_joints[static_cast<std::size_t>(motor.cut)]};
  VectorXd wrench = VectorXd::Zero(recursion::Planar::dim * static_cast<Index>(both_.tree.wrenches.size()));
  const double unit = 1;
  add_along_cuts(both_.tree, joint, &unit, w, wrench.data());
  forces_.load(nullptr, wrench.data(), w);
  forces_.project(q, w, column.data());
}

} // namespace ffrobot
