// What is reported of a planar system, which is integrated in joint coordinates: from the recursion.
#pragma once

#include "core/analysis/run.h"
#include "core/analysis/system_on_tree.h"
#include "core/recursion/prescribed_motion.h"

#include <optional>

namespace ffrobot {

// Largest violation of C_ddot = `targets` by accelerations of the tree, a (n_v), relative to the terms that cancel in
// it. Computed from a alone, not from the elimination that made it: after the accelerate() of a, with its workspace.
double acceleration_residual(const SystemOnTree &both, const std::vector<Jet> &targets, const double *a,
                             const recursion::NewtonEuler<recursion::Planar> &forces,
                             const recursion::Workspace<recursion::Planar, double> &w);

class TreeOutputs {
public:
  // external_loads may be null. `both` and loads must outlive this.
  TreeOutputs(const SystemOnTree &both, std::size_t count, double t, const double *state,
              ExternalLoads *external_loads);

  void operator()(std::size_t i, double t, const double *state); // (q, v) of the tree
  void operator()(std::size_t i, recursion::PrescribedMotion<recursion::Planar> &motion);
  void at(std::size_t i, double t, const double *state); // as it is: not moved onto its rows
  Outputs take(std::size_t reached);

  // Accelerations of the system's coordinates at a state of the tree
  const Eigen::VectorXd &accelerations(double t, const double *state);
  AbsoluteState &absolute() { return absolute_; }

private:
  using TreeWorkspace = recursion::Workspace<recursion::Planar, double>;

  void project(std::size_t output, double t); // state_, with what rows leave of it
  void evaluate(double t, const double *state);
  void write_violation(Eigen::Index i, const Eigen::VectorXd &value, const Eigen::VectorXd &rate);
  void find_accelerations(const double *state, TreeWorkspace &w);
  // Of state_ and a_, w having multipliers and accelerations of frames
  void write(Eigen::Index i, const std::vector<Jet> &targets, const TreeWorkspace &w, const double *wrenches);
  void write_multipliers(Eigen::Index i, const TreeWorkspace &w, const double *wrenches);

  const SystemOnTree &both_;
  std::optional<SteeredTree> steering_;
  TreeMotion motion_;
  AbsoluteState absolute_;
  recursion::NewtonEuler<recursion::Planar> forces_;
  std::optional<recursion::Motors<recursion::Planar>> motors_;
  std::vector<int> of_modes_; // in v
  Eigen::VectorXd state_, a_, system_a_, value_, rate_;
  Outputs outputs_;
};

} // namespace ffrobot
