#include "core/analysis/system_on_tree.h"

#include "core/check_index.h"

#include <stdexcept>

namespace ffrobot {

using Eigen::Index;
using Eigen::VectorXd;

void SystemOnTree::check() const {
  const std::size_t count = system.bodies.size();
  const auto constraints = system.constraints.size();
  bool fits = bodies.size() <= tree.nodes.size() && bodies.size() == count && drives.modes.size() == count;
  for (std::size_t i = 0; fits && i < bodies.size(); ++i)
    fits = bodies[i] < system.bodies.size() && system.bodies[bodies[i]].modes() == tree.nodes[i].n() &&
           drives.modes[bodies[i]] == tree.nodes[i].p_v();
  if (!fits)
    throw std::invalid_argument("bodies: expected those of the system, with as many modes, found others");
  for (const auto &[drive, coordinate, share] : drives.along)
    check_index("drive", drive, system.drives.size()), check_index("coordinate", coordinate, tree.n_v);
  for (const auto &[drive, wrench, component, share] : drives.at_points) {
    check_index("drive", drive, system.drives.size());
    check_index("wrench", wrench, tree.wrenches.size());
    check_index("component", component, recursion::Planar::dim);
  }
  for (const auto &[constraint, row, sign, is_trajectory] : reactions.rows)
    check_index("constraint", constraint, constraints), check_index("row", row, tree.rows.size());
  for (const auto &[constraint, node, component, backwards] : reactions.joints)
    check_index("constraint", constraint, constraints), check_index("node", node, count);
  for (const auto &[constraint, value] : reactions.weights)
    check_index("constraint", constraint, constraints);
  for (const auto &[drive, joint] : drives.along_cuts)
    check_index("drive", drive, system.drives.size()), check_index("cut joint", joint, scene.cut_joints.size());
  driven().check();
}

recursion::DrivenMechanism<recursion::Planar> SystemOnTree::driven() const {
  std::vector<char> is_path(tree.rows.size(), false);
  for (const auto &row : reactions.rows)
    is_path[static_cast<std::size_t>(row.row)] = row.is_trajectory;
  recursion::DrivenMechanism<recursion::Planar> found(tree, scene, reactions.motors, std::move(is_path));
  found.of_modes.clear();
  for (std::size_t b = 0; b < system.bodies.size(); ++b)
    for (int k = 0; k < static_cast<int>(system.bodies[b].modes()); ++k)
      found.of_modes.push_back(drives.modes[b] + k);
  return found;
}

namespace {

// Of the rotor before a gear that gives, over its ratio N: theta + alpha/N where the output turns by theta on the body
// at alpha, at output = alpha + theta; rates and accelerations alike.
double rotor_over_ratio(const recursion::Node<recursion::Planar> &node, double theta, double output) {
  return theta + (output - theta) / node.gear_ratio;
}

} // namespace

AbsoluteState::AbsoluteState(const SystemOnTree &both)
    : both_(both), workspace_(both.tree), state_(VectorXd::Zero(2 * both.system.coordinates)) {}

const VectorXd &AbsoluteState::operator()(const double *state) {
  return (*this)(state, recursion::frame_poses(both_.tree, state, state + both_.tree.n_q, workspace_));
}

const VectorXd &AbsoluteState::operator()(const double *state, const std::vector<recursion::Pose<double>> &frames) {
  const System &system = both_.system;
  const double *q = state, *v = state + both_.tree.n_q;
  for (std::size_t i = 0; i < both_.bodies.size(); ++i) {
    const auto &node = both_.tree.nodes[i];
    const auto &[r, r_dot, omega, R, angle] = frames[i];
    const double x = node.origin[0], y = node.origin[1]; // of the body's frame, in axes of the tree's
    const double d_x = R[0][0] * x + R[0][1] * y, d_y = R[1][0] * x + R[1][1] * y;
    const Index at = system.first_coordinate[both_.bodies[i]], at_rate = system.coordinates + at;
    if (node.is_weightless) {
      const double theta = q[node.q], theta_dot = v[node.v];
      state_.segment<3>(at) << 0, 0, rotor_over_ratio(node, theta, angle);
      state_.segment<3>(at_rate) << 0, 0, rotor_over_ratio(node, theta_dot, omega[2]);
      continue;
    }
    state_.segment<3>(at) << r[0] + d_x, r[1] + d_y, angle - node.turn;
    state_.segment<3>(at_rate) << r_dot[0] - omega[2] * d_y, r_dot[1] + omega[2] * d_x, omega[2];
    state_.segment(at + 3, node.n()) = Eigen::Map<const VectorXd>(q + node.p_q(), node.n());
    state_.segment(at_rate + 3, node.n()) = Eigen::Map<const VectorXd>(v + node.p_v(), node.n());
  }
  return state_;
}

void AbsoluteState::accelerations(const std::vector<recursion::FrameMotion> &frames, const double *a_tree,
                                  double *a) const {
  for (std::size_t i = 0; i < both_.bodies.size(); ++i) {
    const auto &node = both_.tree.nodes[i];
    double *of_body = a + both_.system.first_coordinate[both_.bodies[i]];
    if (node.is_weightless) {
      of_body[0] = of_body[1] = 0;
      of_body[2] = rotor_over_ratio(node, a_tree[node.v], frames[i].alpha[2]);
      continue;
    }
    of_body[0] = frames[i].a_origin[0], of_body[1] = frames[i].a_origin[1], of_body[2] = frames[i].alpha[2];
    std::copy_n(a_tree + node.p_v(), node.n(), of_body + 3);
  }
}

SteeredTree::SteeredTree(const SystemOnTree &both, ExternalLoads &loads) : loads_(loads), drives_(both.drives) {
  forces_.drive.assign(both.system.drives.size(), 0.0);
  for (const auto &body : both.system.bodies)
    forces_.modal.emplace_back(VectorXd::Zero(body.modes()));
}

void SteeredTree::add(double t, const double *, double *force, double *wrench) {
  loads_.apply(t, forces_);
  for (const auto &[drive, coordinate, share] : drives_.along)
    force[coordinate] += share * forces_.drive[drive];
  for (const auto &[drive, at, component, share] : drives_.at_points)
    wrench[recursion::Planar::dim * at + component] += share * forces_.drive[drive];
  if (!forces_.has_modal)
    return;
  for (std::size_t b = 0; b < drives_.modes.size(); ++b) {
    const VectorXd &modal = forces_.modal[b];
    Eigen::Map<VectorXd>(force + drives_.modes[b], modal.size()) += modal;
  }
}

void SteeredTree::add_along_cuts(double *along) {
  for (const auto &[drive, joint] : drives_.along_cuts)
    along[joint] += forces_.drive[drive];
}

} // namespace ffrobot
