#include "core/analysis/tree_outputs.h"

#include <algorithm>
#include <cmath>

namespace ffrobot {

using Eigen::Index;
using Eigen::VectorXd;

double acceleration_residual(const SystemOnTree &both, const std::vector<Jet> &targets, const double *a,
                             const recursion::NewtonEuler<recursion::Planar> &forces,
                             const recursion::Workspace<recursion::Planar, double> &w) {
  double worst = 0;
  for (std::size_t r = 0; r < both.tree.rows.size(); ++r) {
    const double target = targets[r].acceleration;
    const auto [value, size] = forces.of_row(r, a, w);
    worst = std::max(worst, std::abs(value - target) / (1 + std::abs(target) + size));
  }
  return worst;
}

TreeOutputs::TreeOutputs(const SystemOnTree &both, std::size_t count, double t, const double *state,
                         ExternalLoads *external_loads)
    : both_(both), steering_(external_loads ? std::make_optional<SteeredTree>(both, *external_loads) : std::nullopt),
      motion_(both.tree, both.scene, t, state, state + both.tree.n_q, nullptr, steering_ ? &*steering_ : nullptr),
      absolute_(both), forces_(both.tree), state_(both.state_size()), a_(both.tree.n_v),
      system_a_(both.system.coordinates), value_(VectorXd::Zero(static_cast<Index>(both.tree.rows.size()))),
      rate_(value_) {
  const auto T = static_cast<Index>(count);
  const System &system = both.system;
  for (auto *x : {&outputs_.q, &outputs_.v, &outputs_.a})
    x->resize(T, system.coordinates);
  outputs_.lambda = RowMajorMatrix::Zero(T, static_cast<Index>(system.constraints.size()));
  outputs_.residual = RowMajorMatrix::Zero(T, 3);
  if (both.reactions.motors.empty())
    return;
  of_modes_ = both.driven().of_modes;
  motors_.emplace(both.driven());
  outputs_.tau.resize(T, motors_->tau().size());
  outputs_.F_p.resize(T, system.n_modes());
}

void TreeOutputs::evaluate(double t, const double *state) {
  motion_.evaluate(t, state, state + both_.tree.n_q, a_.data());
  find_accelerations(state, motion_.workspace());
}

void TreeOutputs::find_accelerations(const double *state, TreeWorkspace &w) {
  const double *q = state, *v = state + both_.tree.n_q;
  forces_.accelerate(q, a_.data(), w);
  absolute_.accelerations(recursion::frame_motions(both_.tree, q, v, w), a_.data(), system_a_.data());
}

const VectorXd &TreeOutputs::accelerations(double t, const double *state) {
  evaluate(t, state);
  return system_a_;
}

void TreeOutputs::project(std::size_t output, double t) {
  const Index n_q = both_.tree.n_q;
  motion_.evaluate(t, state_.data(), state_.data() + n_q, a_.data());
  motion_.project(t, state_.data(), state_.data() + n_q);
  motion_.constraint_values(t, state_.data(), value_.data(), rate_.data());
  write_violation(static_cast<Index>(output), value_, rate_);
}

void TreeOutputs::operator()(std::size_t output, double t, const double *state) {
  const auto i = static_cast<Index>(output);
  state_ = Eigen::Map<const VectorXd>(state, state_.size());
  if (!both_.tree.rows.empty())
    project(output, t);
  evaluate(t, state_.data());
  write(i, targets_at(both_.scene, t), motion_.workspace(), motion_.wrenches());
}

void TreeOutputs::at(std::size_t output, double t, const double *state) {
  state_ = Eigen::Map<const VectorXd>(state, state_.size());
  evaluate(t, state);
  write(static_cast<Index>(output), targets_at(both_.scene, t), motion_.workspace(), motion_.wrenches());
}

void TreeOutputs::operator()(std::size_t output, recursion::PrescribedMotion<recursion::Planar> &motion) {
  const auto i = static_cast<Index>(output);
  state_ = motion.state();
  a_ = motion.a();
  write_violation(i, motion.values(), motion.rates());
  find_accelerations(state_.data(), motion.workspace());
  write(i, motion.targets(), motion.workspace(), motion.wrenches());
  if (outputs_.shape_force.size() == 0)
    outputs_.shape_force.resize(outputs_.q.rows(), both_.system.n_modes());
  outputs_.shape_force.row(i) = motion.shape_force().transpose();
  if (motors_)
    outputs_.F_p.row(i) += outputs_.shape_force.row(i);
}

void TreeOutputs::write_violation(Index i, const VectorXd &value, const VectorXd &rate) {
  const Index n_q = both_.tree.n_q, n_v = both_.tree.n_v;
  outputs_.residual(i, 0) = value.lpNorm<Eigen::Infinity>() / (1 + state_.head(n_q).lpNorm<Eigen::Infinity>());
  outputs_.residual(i, 1) = rate.lpNorm<Eigen::Infinity>() / (1 + state_.tail(n_v).lpNorm<Eigen::Infinity>());
}

void TreeOutputs::write(Index i, const std::vector<Jet> &targets, const TreeWorkspace &w, const double *wrenches) {
  outputs_.residual(i, 2) = acceleration_residual(both_, targets, a_.data(), forces_, w);
  const VectorXd &absolute = absolute_(state_.data(), w.frames);
  outputs_.q.row(i) = absolute.head(both_.system.coordinates).transpose();
  outputs_.v.row(i) = absolute.tail(both_.system.coordinates).transpose();
  outputs_.a.row(i) = system_a_.transpose();
  write_multipliers(i, w, wrenches);
  if (!motors_)
    return;
  motors_->resolve(state_.data(), w.lambda.data(), w);
  outputs_.tau.row(i) = motors_->tau().transpose();
  outputs_.F_p.row(i) = motors_->left()(of_modes_).transpose();
}

// Those of joints are, with their signs, components of what these transmit.
void TreeOutputs::write_multipliers(Index i, const TreeWorkspace &w, const double *wrenches) {
  for (const auto &[constraint, row, sign, is_trajectory] : both_.reactions.rows)
    outputs_.lambda(i, constraint) = sign * w.lambda[static_cast<std::size_t>(row)];
  for (const auto &[constraint, value] : both_.reactions.weights)
    outputs_.lambda(i, constraint) = value;
  if (both_.reactions.joints.empty())
    return;
  forces_.load(w.lambda.data(), wrenches, w);
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
      on_outer = backwards ? forces_.about_inner(at)[2] : forces_.in_joint_axes(at)[2];
      break;
    case across:
      on_outer = forces_.in_joint_axes(at)[1];
    }
    outputs_.lambda(i, constraint) = backwards ? on_outer : -on_outer;
  }
}

Outputs TreeOutputs::take(std::size_t reached) {
  const auto T = static_cast<Index>(reached);
  for (auto *x : {&outputs_.q, &outputs_.v, &outputs_.a, &outputs_.lambda, &outputs_.residual, &outputs_.shape_force})
    x->conservativeResize(T, Eigen::NoChange);
  if (motors_)
    for (auto *x : {&outputs_.tau, &outputs_.F_p})
      x->conservativeResize(T, Eigen::NoChange);
  return std::move(outputs_);
}

} // namespace ffrobot
