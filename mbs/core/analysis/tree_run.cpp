#include "core/analysis/tree_run.h"

#include <stdexcept>

namespace ffrobot {

using Eigen::Index;
using Eigen::VectorXd;

AbsoluteState::AbsoluteState(const System &system, const PlanarTree &tree, std::vector<std::size_t> bodies)
    : system_(system), tree_(tree), bodies_(std::move(bodies)), workspace_(tree),
      state_(VectorXd::Zero(system.n_q() + system.n_v())) {
  bool fits = bodies_.size() == tree.nodes.size() && bodies_.size() == system.bodies.size();
  for (std::size_t i = 0; fits && i < bodies_.size(); ++i)
    fits = bodies_[i] < system.bodies.size() && system.bodies[bodies_[i]].modes() == tree.nodes[i].n();
  if (!fits)
    throw std::invalid_argument("bodies: expected those of the system, with as many modes, found others");
}

const VectorXd &AbsoluteState::operator()(const double *state) {
  const double *q = state, *v = state + tree_.n_q;
  const auto &frames = recursion::frame_poses(tree_, q, v, workspace_);
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const auto &node = tree_.nodes[i];
    const auto &[r, r_dot, omega, R, angle] = frames[i];
    const double x = node.origin[0], y = node.origin[1]; // of the body's frame, in axes of the tree's
    const double d_x = R[0][0] * x + R[0][1] * y, d_y = R[1][0] * x + R[1][1] * y;
    const Index at = system_.first_coordinate[bodies_[i]], at_rate = system_.n_q() + at;
    if (node.is_weightless) { // the rotor before a gear, whose frame stays at the origin
      const double N = node.gear_ratio, theta = q[node.q], theta_dot = v[node.v];
      state_.segment<3>(at) << 0, 0, theta + (angle - theta) / N;
      state_.segment<3>(at_rate) << 0, 0, theta_dot + (omega[2] - theta_dot) / N;
      continue;
    }
    state_.segment<3>(at) << r[0] + d_x, r[1] + d_y, angle - node.turn;
    state_.segment<3>(at_rate) << r_dot[0] - omega[2] * d_y, r_dot[1] + omega[2] * d_x, omega[2];
    state_.segment(at + 3, node.n()) = Eigen::Map<const VectorXd>(q + node.p_q(), node.n());
    state_.segment(at_rate + 3, node.n()) = Eigen::Map<const VectorXd>(v + node.p_v(), node.n());
  }
  return state_;
}

void SteeredTree::add(double t, double *force, double *wrench) {
  loads_.apply(t, workspace_);
  for (const auto &[drive, coordinate, share] : drives_.along)
    force[coordinate] += share * workspace_.external_drive[drive];
  for (const auto &[drive, at, component, share] : drives_.at_points)
    wrench[recursion::Planar::dim * at + component] += share * workspace_.external_drive[drive];
  if (!workspace_.has_external_modal)
    return;
  for (std::size_t b = 0; b < drives_.modes.size(); ++b) {
    const VectorXd &modal = workspace_.external_modal[b];
    Eigen::Map<VectorXd>(force + drives_.modes[b], modal.size()) += modal;
  }
}

namespace {

// Steps that go on where `recording` ends, as its steps
void append(const Recording &steps, AbsoluteState &absolute, Recording &recording) {
  const std::size_t known = recording.times.empty() ? 0 : 1; // the state that both have
  const std::size_t before = recording.times.size() - known;
  for (std::size_t i = known; i < steps.times.size(); ++i) {
    const VectorXd &state = absolute(steps.states.data() + i * static_cast<std::size_t>(absolute.state_size()));
    recording.times.push_back(steps.times[i]);
    recording.states.insert(recording.states.end(), state.data(), state.data() + state.size());
  }
  for (std::size_t i = known; i < steps.methods.size(); ++i)
    recording.methods.emplace_back(before + steps.methods[i].first, steps.methods[i].second);
  recording.tolerance = steps.tolerance;
}

} // namespace

Run run(recursion::RecursiveMotion<recursion::Planar> &motion, AbsoluteState absolute, const std::vector<double> &times,
        const VectorXd &q, const VectorXd &v, const IntegrationControls &controls, OutputEvaluator evaluate,
        const std::function<bool(double)> &carry_on, Recording *recording, IntegrationCheckpoint *checkpoint) {
  Run result;
  VectorXd last(q.size() + v.size());
  last << q, v;
  Recording steps;
  if (recording && !recording->times.empty() && checkpoint && checkpoint->has_begun()) {
    steps.times = {checkpoint->time};
    steps.states = {checkpoint->state.begin(), checkpoint->state.end()};
    steps.methods = {{0, recording->methods.back().second}};
  }
  result.report = integrate(
      motion, times, last, controls,
      [&](std::size_t i, double t, const double *state) { evaluate(i, t, absolute(state).data()); }, carry_on,
      recording ? &steps : nullptr, nullptr, checkpoint);
  if (recording)
    append(steps, absolute, *recording);
  result.last = absolute(last.data());
  result.outputs = evaluate.take(result.report.outputs);
  return result;
}

} // namespace ffrobot
