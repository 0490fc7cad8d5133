// What a mechanism follows and what acts on it, as the caller says it.
#pragma once

#include "core/integrate/limit_watch.h"
#include "core/recursion/constrained_aba/loop_joint.h"
#include "core/recursion/constrained_aba/point_force.h"
#include "core/recursion/motion/mobility.h"

#include <utility>

namespace ffrobot::recursion {

// `magnitude`(t) times a direction in generalized forces: joint moments, modal
// forces of patches.
struct Load {
  Load(const VectorXd &direction,
       TimeFunction magnitude_); // direction (n_v)

  std::vector<std::pair<int, double>> along; // entries of v that it acts on
  TimeFunction magnitude;
};

// `share` times `magnitude`(t) along a component of the force (N), then the
// moment (N m), global axes, on a wrench of the mechanism.
struct PointLoad {
  int wrench = 0, component = 0;
  TimeFunction magnitude;
  double share = 1;
};

// How a marker of the ground turns.
struct DrivenMarker {
  int marker = 0;
  OrientationLaw law;
};

// Along a joint's coordinate: spring about `rest`, viscous and Coulomb
// friction.
struct JointForce {
  int q = 0, v = 0;     // of the coordinate
  double stiffness = 0; // N m/rad, N/m
  double rest = 0;      // rad, m
  Friction friction;

  FFROBOT_FIELDS(q, v, stiffness, rest, friction);
};

// Moment (N m) of a twist (rad), odd and piecewise linear: slopes (N m/rad), and the twists from which on the next one
// counts. A linear spring has one slope.
struct TwistSpring {
  std::vector<double> slopes{0}, knots;

  FFROBOT_FIELDS(slopes, knots);

  double moment(double twist) const {
    const double way = std::abs(twist);
    double sum = slopes[0] * way;
    for (std::size_t k = 0; k < knots.size(); ++k)
      sum += (slopes[k + 1] - slopes[k]) * std::max(way - knots[k], 0.);
    return std::copysign(sum, twist);
  }

  double slope(double twist) const {
    std::size_t k = 0;
    while (k < knots.size() && std::abs(twist) > knots[k])
      ++k;
    return slopes[k];
  }

  double energy(double twist) const { // J
    const double way = std::abs(twist);
    double sum = slopes[0] * way * way;
    for (std::size_t k = 0; k < knots.size(); ++k)
      if (const double beyond = way - knots[k]; beyond > 0)
        sum += (slopes[k + 1] - slopes[k]) * beyond * beyond;
    return 0.5 * sum;
  }
};

// Between two joint coordinates, as a compliant gear: moments (N m) of the twist a - ratio b on both.
struct GearSpring {
  struct Side {
    int q = 0, v = 0;

    FFROBOT_FIELDS(q, v);
  } a, b;
  double ratio = 1;
  TwistSpring spring;
  double damping = 0; // N m s/rad

  FFROBOT_FIELDS(a, b, ratio, spring, damping);
};

// `share` times `magnitude`(t), N m or N, along the coordinate of a joint at which a loop is cut.
struct CutLoad {
  int joint = 0; // of the scene's cut joints
  TimeFunction magnitude;
  double share = 1;
};

// What a constraint equation follows: sign * law(t), with rate and acceleration.
struct Target {
  TimeFunction law;
  double sign = 1;

  Jet operator()(double t) const {
    const Jet jet = law(t);
    return {sign * jet.value, sign * jet.rate, sign * jet.acceleration};
  }
};

struct Scene {
  std::vector<Target> targets; // of constraint equations
  std::vector<Load> loads;
  std::vector<PointLoad> point_loads;
  std::vector<PointForce> point_forces;
  std::vector<JointForce> joint_forces;
  std::vector<GearSpring> gears;
  std::vector<CutJoint> cut_joints;
  std::vector<CutLoad> cut_loads;
  std::vector<DrivenMarker> driven;
  std::optional<PostureWatch> watch;
  std::vector<LimitedCoordinate> limits; // of joints; told, nothing acts there
  // Constraint equations close some: those that depend on others are left out, and steps do not lead across postures in
  // which all depend on each other. Else all are independent.
  bool has_loops = false;
  std::vector<double>
      modal_amplitude_limits; // of each node, kg m^2: p^T p beyond it makes no sense; empty: none is too large
};

// Puts the markers of the ground that turn where they are at time t.
template <class Workspace> void turn_markers(const Scene &scene, double t, Workspace &w) {
  for (const DrivenMarker &driven : scene.driven)
    w.turning[driven.marker] = driven.law(t);
}

std::vector<Jet> targets_at(const Scene &scene, double t); // of all constraint equations

// Takes targets off the values and rates (constraints) that measure() has found.
void take_off(const std::vector<Jet> &targets, const std::vector<Constraint> &constraints, VectorXd &value,
              VectorXd &rate);

} // namespace ffrobot::recursion
