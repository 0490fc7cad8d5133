// A whole analysis of a planar system that is integrated in joint coordinates (core/recursion) and observed in the
// system's own: outputs, and all that is found of them, are those of run(), and so are recordings of steps.
#pragma once

#include "core/analysis/run.h"
#include "core/recursion/motion.h"
#include "core/recursion/observe.h"

namespace ffrobot {

using PlanarTree = recursion::Mechanism<recursion::Planar>;

// States of a system, (R, theta, p) of each body and their rates, by those of a tree of the same bodies. The output of
// a gear that gives stands for the rotor before it: theta is the rotor's angle over the gear's ratio.
class AbsoluteState {
public:
  // bodies[i]: number in the system of node i. Both must outlive this; throws std::invalid_argument where the tree has
  // other bodies.
  AbsoluteState(const System &system, const PlanarTree &tree, std::vector<std::size_t> bodies);

  // (q, v) of the system for that of the tree
  const Eigen::VectorXd &operator()(const double *state);
  Eigen::Index state_size() const { return tree_.n_q + tree_.n_v; } // of the tree

private:
  const System &system_;
  const PlanarTree &tree_;
  std::vector<std::size_t> bodies_;
  recursion::Workspace<recursion::Planar, double> workspace_;
  Eigen::VectorXd state_;
};

// Where the drives and modal forces of a system act in a tree.
struct DrivesOnTree {
  struct Along {
    std::size_t drive;
    int coordinate; // in v
    double share;
  };
  struct AtPoint {
    std::size_t drive;
    int wrench, component;
    double share;
  };
  std::vector<Along> along;
  std::vector<AtPoint> at_points;
  std::vector<int> modes; // of each body of the system, in v
};

// What loads from outside a system, which they are set for, do to a tree.
class SteeredTree final : public recursion::Steering {
public:
  // All must outlive this.
  SteeredTree(const System &system, ExternalLoads &loads, const DrivesOnTree &drives)
      : loads_(loads), drives_(drives), workspace_(system) {}

  void add(double t, double *force, double *wrench) override;

private:
  ExternalLoads &loads_;
  const DrivesOnTree &drives_;
  Workspace workspace_;
};

// Integrates `motion` from (q, v) of the tree, outputs, `recording` and the last state being those of the system;
// otherwise as the run() of a system. The checkpoint is one of the tree, and so is all that `motion` remembers.
Run run(recursion::RecursiveMotion<recursion::Planar> &motion, AbsoluteState absolute, const std::vector<double> &times,
        const Eigen::VectorXd &q, const Eigen::VectorXd &v, const IntegrationControls &controls,
        OutputEvaluator evaluate, const std::function<bool(double)> &carry_on, Recording *recording,
        IntegrationCheckpoint *checkpoint);

} // namespace ffrobot
