#include "core/analysis/tree_replay.h"

#include "core/actuation/points.h"

#include <algorithm>

namespace ffrobot {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

TreeMotion motion_of(const SystemOnTree &both, const Recording &recording) {
  const double *state = recording.states.data();
  return {both.tree, both.scene, recording.times.front(), state, state + both.tree.n_q};
}

} // namespace

TreeActuation::TreeActuation(const SystemOnTree &both, const Recording &recording)
    : ActuationSource(both.system), both_(both), steps_(motion_of(both, recording)),
      motion_(motion_of(both, recording)), recorded_(steps_, recording), absolute_(both), workspace_(both.system),
      a_(both.tree.n_v) {
  const auto &rows = both.reactions.rows;
  trajectory_force_ = VectorXd::Zero(std::ranges::count_if(rows, [](const auto &row) { return row.is_trajectory; }));
  if (!both.reactions.motors.empty())
    motors_.emplace(both);
}

void TreeActuation::find(double t) {
  state_ = Eigen::Map<const VectorXd>(recorded_.state(t), both_.state_size());
  const double *q = state_.data();
  motion_.evaluate(t, q, q + both_.tree.n_q, a_.data());
  const auto &w = motion_.workspace();
  Index k = 0;
  for (const auto &[constraint, row, sign, is_trajectory] : both_.reactions.rows)
    if (is_trajectory)
      trajectory_force_[k++] = -sign * w.lambda[static_cast<std::size_t>(row)];
  if (!motors_)
    return;
  motors_->resolve(q, w.lambda.data(), w);
  tau_ = motors_->tau(), modal_force_ = motors_->modal_force();
}

ActuationSource::OnBody TreeActuation::on_body(std::size_t body) {
  const System &system = both_.system;
  const VectorXd &y = absolute_(state_.data());
  update_kinematics(system, y.data(), y.data() + system.n_q(), workspace_);
  std::vector<bool> is_trajectory(system.n_bilateral(), false);
  Index k = 0;
  for (const auto &row : both_.reactions.rows)
    if (row.is_trajectory) {
      const auto r = static_cast<std::size_t>(row.constraint);
      is_trajectory[r] = true;
      workspace_.lambda[row.constraint] = -trajectory_force_[k++];
      ffrobot::evaluate(system.rows[r], workspace_.bodies, workspace_.rows[r]);
    }
  const Index n = system.bodies[body].modes();
  OnBody found{y.segment(system.first_coordinate[body], 3 + n), {}};
  driving_force(
      system, workspace_, [&](std::size_t r) { return is_trajectory[r]; }, VectorXd::Zero(n), body, found.Q_a);
  return found;
}

} // namespace ffrobot
