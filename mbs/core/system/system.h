// A planar mechanism as scenes describe it, in absolute coordinates (R, theta, p) of its bodies: what constraints,
// drives and sensors measure, and the forces of a known motion. Motions themselves are found in joint coordinates
// (core/recursion), and told in these (core/analysis/system_on_tree.h).
//
// System holds constants, Workspace everything that changes; algorithms are free functions of both.
#pragma once

#include "core/body/planar_body.h"
#include "core/constraint/constraint.h"
#include "core/constraint/state_force.h"

#include <vector>

namespace ffrobot {

// Modal forces `vector * magnitude(t)` on one body: PZT patches.
struct ModalDrive {
  int body;
  Eigen::VectorXd vector;
  TimeFunction magnitude;
};

struct System {
  Eigen::Vector2d gravity = Eigen::Vector2d::Zero(); // m/s^2, global axes
  std::vector<PlanarBody> bodies;
  std::vector<Constraint> constraints;
  std::vector<Rotor> rotors;
  std::vector<Drive> drives;
  std::vector<Spring> springs;
  std::vector<ModalDrive> modal_drives;
  std::vector<StateForce> state_forces;

  // Derived from the above by finish()
  std::vector<Eigen::Index> first_coordinate; // of each body, in q and in v
  Eigen::Index coordinates = 0;               // of q and of v
  double length = 0;                          // m, of the bodies: what positions are compared with

  Eigen::Index n_modes() const; // of all bodies

  void finish();
};

struct Workspace {
  explicit Workspace(const System &system);

  std::vector<PlanarBodyState> bodies;
  std::vector<Eigen::Matrix3Xd> wrench; // on the markers of each body: of drives, springs and forces of the motion
};

// Below: q, v, a and generalized forces (coordinates), values of constraints (constraints).

// Positions and velocities of all markers.
void update_kinematics(const System &system, const double *q, const double *v, Workspace &w);

// Values C and rates C_dot; refreshes the kinematics.
void constraint_residuals(const System &system, double t, const double *q, const double *v, Workspace &w, double *value,
                          double *rate);

// C_q (constraints, coordinates), dense, at the coordinates of the last kinematics.
Eigen::MatrixXd constraint_jacobian(const System &system, const Workspace &w);

// Acceleration of any row's value, without its target, where `motion` is that of the row in w.
double row_acceleration(const System &system, const Measure &row, const MeasureMotion &motion, const double *a,
                        const Workspace &w);

// Generalized forces Q of gravity, elasticity and drives, at rest.
void static_force(const System &system, double t, const double *q, Workspace &w, double *Q);

// f = M a - Q: what constraints and actuators must supply for the accelerations a, drives taken off.
void required_force(const System &system, double t, const double *q, const double *v, const double *a, Workspace &w,
                    double *f);

} // namespace ffrobot
