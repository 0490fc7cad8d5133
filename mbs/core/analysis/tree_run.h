// A whole analysis of a planar system that is integrated in joint coordinates (core/recursion) and observed in the
// system's own: what errors are measured by, outputs and recordings of steps are those of run().
#pragma once

#include "core/analysis/run.h"
#include "core/recursion/motion.h"
#include "core/recursion/observe.h"

namespace ffrobot {

using PlanarTree = recursion::Mechanism<recursion::Planar>;

// States of a system, (R, theta, p) of each body and their rates, by those of a tree of the same bodies.
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

// The motion of a tree as a system that methods step, its errors judged as those of its system: `observed`, which is
// evaluated where a step ends.
class TreeMotion final : public ImplicitSystem {
public:
  using Tree = recursion::RecursiveMotion<recursion::Planar>;

  // All must outlive this.
  TreeMotion(Tree &tree, ConstrainedMotion &observed, AbsoluteState &absolute);

  double error_size(double t, const double *z, const double *e) override;
  double change_size(const double *z, const double *change, double rate) const override;
  void accepted(double t, const double *z, const double *z_dot) override;
  bool is_sensible(const double *z) const override { return observed_.is_sensible(absolute_(z).data()); }
  Eigen::Index prescribed() const override { return observed_.prescribed(); }
  void prescribe(double t, double *f) override { observed_.prescribe(t, f); }
  double initial_step() const override { return observed_.initial_step(); }
  unsigned long evaluations() const override { return tree_.evaluations() + observed_.evaluations(); }

  void slope(double t, const double *z, double *z_dot) override { tree_.slope(t, z, z_dot); }
  bool correct(double t, double *z) override { return tree_.correct(t, z); }
  Eigen::Index constraints() const override { return tree_.constraints(); }
  const Eigen::VectorXd &stiffness() const override { return tree_.stiffness(); }
  const Eigen::VectorXd &damping() const override { return tree_.damping(); }
  void factorise(double damping_factor, double stiffness_factor) override {
    tree_.factorise(damping_factor, stiffness_factor);
  }
  void factorise(Complex damping_factor, Complex stiffness_factor) override {
    tree_.factorise(damping_factor, stiffness_factor);
  }
  void solve(const double *r, const double *c, double *x) override { tree_.solve(r, c, x); }
  void solve(const Complex *r, Complex *x) override { tree_.solve(r, x); }
  void constrain(const double *x, double *c) override { tree_.constrain(x, c); }
  void constraint_values(double t, const double *z, double *value, double *rate) override {
    tree_.constraint_values(t, z, value, rate);
  }

  ErrorNorm &norm() { return observed_.norm(); }

private:
  void observe(double t, const double *z); // into y_ and y_dot_, unless they are there

  Tree &tree_;
  ConstrainedMotion &observed_;
  AbsoluteState &absolute_;
  double time_; // of y_
  Eigen::VectorXd z_, shifted_, y_, y_dot_, error_;
};

// Integrates the tree from its (q, v). Outputs, `recording`, the last state and the peaks of the checkpoint are those
// of the system, the checkpoint's state is that of the tree: the steps after it are those that the run would have made.
// Otherwise as the run() of a system.
Run run(TreeMotion &motion, AbsoluteState &absolute, const std::vector<double> &times, const Eigen::VectorXd &q,
        const Eigen::VectorXd &v, const IntegrationControls &controls, OutputEvaluator evaluate,
        const std::function<bool(double)> &carry_on, Recording *recording, Checkpoint *checkpoint);

} // namespace ffrobot
