// A planar system and a tree of the same bodies in joint coordinates (core/recursion): how states, loads, multipliers
// and motor forces of the one are told in the other.
#pragma once

#include "core/actuation/external_loads.h"
#include "core/recursion/motors.h"
#include "core/recursion/observe.h"
#include "core/system/system.h"

namespace ffrobot {

using PlanarTree = recursion::Mechanism<recursion::Planar>;
using TreeMotion = recursion::RecursiveMotion<recursion::Planar>;

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
  struct AlongCut {
    std::size_t drive;
    int joint; // of the scene's cut joints
  };
  std::vector<Along> along;
  std::vector<AtPoint> at_points;
  std::vector<int> modes; // of each body of the system, in v
  std::vector<AlongCut> along_cuts;
};

// What the constraints and motors of a system are in a tree.
struct ReactionsOnTree {
  struct OfRow {
    int constraint, row; // of the tree
    double sign;
    bool is_trajectory; // else of a joint that closes a loop
  };
  enum class Component { x, y, moment, across }; // global axes; the moment; y of the axes of a prismatic joint
  struct OfJoint {
    int constraint, node;
    Component component;
    bool backwards; // the node is the first side of the joint, on which the multiplier acts with its sign
  };
  struct Weight {
    int constraint;
    double value; // N
  };
  std::vector<OfRow> rows;
  std::vector<OfJoint> joints;
  std::vector<Weight> weights; // of rotors before gears that give, whose frames stay where they are
  std::vector<recursion::Motor> motors;
};

struct SystemOnTree {
  const System &system;
  const PlanarTree &tree;
  const recursion::Scene &scene;
  std::vector<std::size_t> bodies; // numbers in the system of the first nodes; those after them are no bodies of it
  DrivesOnTree drives;
  ReactionsOnTree reactions;

  Eigen::Index state_size() const { return tree.n_q + tree.n_v; }
  recursion::DrivenMechanism<recursion::Planar> driven() const; // modes in the order of the system
  void check() const; // throws std::invalid_argument where one names what the other does not have
};

// States of a system, (R, theta, p) of each body, by those of a tree. The output of a gear that gives stands for the
// rotor before it, whose frame stays at the origin: theta is the rotor's angle over the gear's ratio.
class AbsoluteState {
public:
  explicit AbsoluteState(const SystemOnTree &both); // which must outlive this

  // (q, v) of the system for that of the tree; where it is known what `frames` do there, from these.
  const Eigen::VectorXd &operator()(const double *state);
  const Eigen::VectorXd &operator()(const double *state, const std::vector<recursion::Pose<double>> &frames);

  Eigen::Index coordinates() const { return both_.system.coordinates; } // of q and of v

  // a (coordinates of the system) for that of the tree, where frames move as they do
  void accelerations(const std::vector<recursion::FrameMotion> &frames, const double *a_tree, double *a) const;

private:
  const SystemOnTree &both_;
  recursion::Workspace<recursion::Planar, double> workspace_;
  Eigen::VectorXd state_;
};

// What loads from outside a system, which they are set for, do to a tree.
class SteeredTree final : public recursion::Steering {
public:
  // All must outlive this.
  SteeredTree(const SystemOnTree &both, ExternalLoads &loads);

  void add(double t, const double *q, double *force, double *wrench) override;
  void add_along_cuts(double *along) override;
  void foresee(const double *times, int count) override { loads_.foresee(times, count); }
  double end_of_step(double t, double h) override { return loads_.end_of_step(t, h); }

private:
  ExternalLoads &loads_;
  const DrivesOnTree &drives_;
  ExternalForces forces_;
};

} // namespace ffrobot
