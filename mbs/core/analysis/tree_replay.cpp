#include "core/analysis/tree_replay.h"

#include "core/actuation/points.h"

#include <algorithm>

namespace ffrobot {

using Eigen::Index;
using Eigen::VectorXd;

TreeSource::TreeSource(const SystemOnTree &both)
    : ActuationSource(both.system), both_(both), absolute_(both), workspace_(both.system), shape_force_(modal_force_) {
  const auto &rows = both.reactions.rows;
  trajectory_force_ = VectorXd::Zero(std::ranges::count_if(rows, [](const auto &row) { return row.is_trajectory; }));
  if (!both.reactions.motors.empty())
    motors_.emplace(both.driven());
}

void TreeSource::take(const double *state, const TreeWorkspace &w, const VectorXd &shape_force) {
  state_ = state, found_ = &w;
  motors_are_known_ = !motors_;
  Index k = 0, column = 0;
  for (const auto &[constraint, row, sign, is_trajectory] : both_.reactions.rows)
    if (is_trajectory)
      trajectory_force_[k++] = -sign * w.lambda[static_cast<std::size_t>(row)];
  if (shape_force.size() > 0)
    for (VectorXd &of_body : shape_force_) {
      of_body = shape_force.segment(column, of_body.size());
      column += of_body.size();
    }
}

void TreeSource::find_motors() {
  if (motors_are_known_)
    return;
  motors_are_known_ = true;
  motors_->resolve(state_, found_->lambda.data(), *found_);
  tau_ = motors_->tau();
  for (std::size_t b = 0; b < modal_force_.size(); ++b)
    modal_force_[b] = motors_->left().segment(both_.drives.modes[b], modal_force_[b].size()) + shape_force_[b];
}

const VectorXd &TreeSource::tau() {
  find_motors();
  return tau_;
}

const std::vector<VectorXd> &TreeSource::modal_force() {
  find_motors();
  return modal_force_;
}

ActuationSource::OnBody TreeSource::on_body(std::size_t body) {
  const System &system = both_.system;
  const VectorXd &y = absolute_(state_);
  update_kinematics(system, y.data(), y.data() + system.coordinates, workspace_);
  std::vector<TrajectoryForce> forces;
  for (const auto &row : both_.reactions.rows)
    if (row.is_trajectory)
      forces.push_back(
          {static_cast<std::size_t>(row.constraint), trajectory_force_[static_cast<Index>(forces.size())]});
  return {y.segment(system.first_coordinate[body], 3 + system.bodies[body].modes()),
          driving_force(system, workspace_, forces, shape_force_[body], body)};
}

namespace {

TreeMotion motion_of(const SystemOnTree &both, const Recording &recording) {
  const double *state = recording.states.data();
  TreeMotion motion(both.tree, both.scene, recording.times.front(), state, state + both.tree.n_q);
  motion.plan(recording.times.back() - recording.times.front());
  return motion;
}

} // namespace

TreeActuation::TreeActuation(const SystemOnTree &both, const Recording &recording)
    : TreeSource(both), motion_(motion_of(both, recording)), recorded_(motion_, recording) {}

bool TreeActuation::find(double t) {
  take(recorded_.state(t), motion_.workspace());
  return !recorded_.is_at_stage();
}

PrescribedActuation::PrescribedActuation(const SystemOnTree &both,
                                         recursion::PrescribedMotion<recursion::Planar> &motion,
                                         std::vector<recursion::ModalShape> shape, const VectorXd &q)
    : TreeSource(both), motion_(motion), shape_(std::move(shape)) {
  motion_.start_at(q);
}

bool PrescribedActuation::find(double t) {
  // was found at all output times before; a failure in between shows as a step that is refused
  if (motion_.move(t, recursion::modes_at(shape_, t)))
    motion_.balance();
  take(motion_.q(), motion_.workspace(), motion_.shape_force());
  return true;
}

} // namespace ffrobot
