#include "core/analysis/tree_outputs.h"

#include "core/actuation/side_by_side.h"

#include <algorithm>
#include <cmath>

namespace ffrobot {

using Eigen::Index;
using Eigen::VectorXd;

double acceleration_residual(const SystemOnTree &both, double t, const double *a, const recursion::NewtonEuler &forces,
                             const recursion::Workspace<recursion::Planar, double> &w) {
  double worst = 0;
  for (std::size_t r = 0; r < both.tree.rows.size(); ++r) {
    const recursion::Row &row = both.tree.rows[r];
    const double target = both.scene.targets[r](t).acceleration;
    auto [value, size] = forces.of_row(r, w);
    if (row.node >= 0)
      value = a[both.tree.nodes[static_cast<std::size_t>(row.node)].v + row.freedom], size = std::abs(value);
    worst = std::max(worst, std::abs(value - target) / (1 + std::abs(target) + size));
  }
  return worst;
}

TreeOutputs::TreeOutputs(const SystemOnTree &both, std::size_t count, double t, const double *state,
                         ExternalLoads *external_loads)
    : both_(both), steering_(external_loads ? std::make_optional<SteeredTree>(both, *external_loads) : std::nullopt),
      motion_(both.tree, both.scene, t, state, state + both.tree.n_q, nullptr, steering_ ? &*steering_ : nullptr),
      absolute_(both), forces_(both.tree), state_(both.state_size()), a_(both.tree.n_v), system_a_(both.system.n_v()),
      value_(VectorXd::Zero(static_cast<Index>(both.tree.rows.size()))), rate_(value_) {
  const auto T = static_cast<Index>(count);
  const System &system = both.system;
  outputs_.q.resize(T, system.n_q());
  for (auto *x : {&outputs_.v, &outputs_.a})
    x->resize(T, system.n_v());
  outputs_.lambda = RowMajorMatrix::Zero(T, static_cast<Index>(system.n_bilateral()));
  outputs_.residual = RowMajorMatrix::Zero(T, 3);
  if (both.reactions.motors.empty())
    return;
  motors_.emplace(both);
  outputs_.tau.resize(T, motors_->tau().size());
  outputs_.F_p.resize(T, system.n_modes());
}

void TreeOutputs::evaluate(double t, const double *state) {
  const double *q = state, *v = state + both_.tree.n_q;
  motion_.evaluate(t, q, v, a_.data());
  forces_.accelerate(q, a_.data(), motion_.workspace());
  absolute_.accelerations(recursion::frame_motions(both_.tree, q, v, motion_.workspace()), a_.data(), system_a_.data());
}

const VectorXd &TreeOutputs::accelerations(double t, const double *state) {
  evaluate(t, state);
  return system_a_;
}

void TreeOutputs::project(std::size_t output, double t) {
  const Index n_q = both_.tree.n_q, n_v = both_.tree.n_v, i = static_cast<Index>(output);
  motion_.evaluate(t, state_.data(), state_.data() + n_q, a_.data());
  motion_.project(t, state_.data(), state_.data() + n_q);
  motion_.constraint_values(t, state_.data(), value_.data(), rate_.data());
  outputs_.residual(i, 0) = value_.lpNorm<Eigen::Infinity>() / (1 + state_.head(n_q).lpNorm<Eigen::Infinity>());
  outputs_.residual(i, 1) = rate_.lpNorm<Eigen::Infinity>() / (1 + state_.tail(n_v).lpNorm<Eigen::Infinity>());
}

void TreeOutputs::operator()(std::size_t output, double t, const double *state) {
  const auto i = static_cast<Index>(output);
  state_ = Eigen::Map<const VectorXd>(state, state_.size());
  if (!both_.tree.rows.empty())
    project(output, t);
  evaluate(t, state_.data());
  outputs_.residual(i, 2) = acceleration_residual(both_, t, a_.data(), forces_, motion_.workspace());
  const VectorXd &absolute = absolute_(state_.data(), motion_.workspace().frames);
  outputs_.q.row(i) = absolute.head(both_.system.n_q()).transpose();
  outputs_.v.row(i) = absolute.tail(both_.system.n_v()).transpose();
  outputs_.a.row(i) = system_a_.transpose();
  write_multipliers(i);
  if (!motors_)
    return;
  motors_->resolve(state_.data(), motion_.workspace().lambda.data(), motion_.workspace());
  outputs_.tau.row(i) = motors_->tau().transpose();
  outputs_.F_p.row(i) = joined(motors_->modal_force(), outputs_.F_p.cols()).transpose();
}

// Those of joints are, with their signs, components of what these transmit.
void TreeOutputs::write_multipliers(Index i) {
  const auto &w = motion_.workspace();
  for (const auto &[constraint, row, sign, is_trajectory] : both_.reactions.rows)
    outputs_.lambda(i, constraint) = sign * w.lambda[static_cast<std::size_t>(row)];
  for (const auto &[constraint, value] : both_.reactions.weights)
    outputs_.lambda(i, constraint) = value;
  if (both_.reactions.joints.empty())
    return;
  forces_.load(w.lambda.data(), motion_.wrenches(), w);
  forces_.transmit(w);
  for (const auto &[constraint, node, component, backwards] : both_.reactions.joints) {
    const auto at = static_cast<std::size_t>(node);
    using enum ReactionsOnTree::Component;
    double on_outer = 0;
    switch (component) {
    case x:
      on_outer = forces_.in_global_axes(at)[0];
      break;
    case y:
      on_outer = forces_.in_global_axes(at)[1];
      break;
    case moment: // about the marker of the second side, where measures take it
      on_outer = backwards ? forces_.about_inner(at) : forces_.in_joint_axes(at)[2];
      break;
    case across:
      on_outer = forces_.in_joint_axes(at)[1];
    }
    outputs_.lambda(i, constraint) = backwards ? on_outer : -on_outer;
  }
}

Outputs TreeOutputs::take(std::size_t reached) {
  const auto T = static_cast<Index>(reached);
  for (auto *x : {&outputs_.q, &outputs_.v, &outputs_.a, &outputs_.lambda, &outputs_.residual})
    x->conservativeResize(T, Eigen::NoChange);
  if (motors_)
    for (auto *x : {&outputs_.tau, &outputs_.F_p})
      x->conservativeResize(T, Eigen::NoChange);
  return std::move(outputs_);
}

} // namespace ffrobot
