// A system of bodies under constraints: C(q, t) = 0, M q_ddot + C_q^T lambda = Q.
//
// System holds constants, Workspace everything that changes; algorithms are free functions of both.
#pragma once

#include "core/body/planar_body.h"
#include "core/constraint/envelope.h"
#include "core/constraint/port_couplings.h"
#include "core/constraint/rows.h"
#include "core/time_function/state_force.h"
#include "core/time_function/time_function.h"

#include <cmath>
#include <limits>
#include <vector>

namespace ffrobot {

// C = row - target(t) = 0, or, with a compliance 1/J, the kinetic energy 1/2 J row_dot^2 of a rotor.
//
// M q_ddot + J d d^T q_ddot with the gradient d of the row is the multiplier mu = J d^T q_ddot of one more row, with
// -1/J on the diagonal: d^T q_ddot - mu/J = 0 beside M q_ddot + d mu = Q. C M^-1 C^T gets 1/J there and stays positive
// definite. Nothing holds such a row: as a constraint its value and rate are 0.
struct Constraint {
  Measure row;
  TimeFunction target;
  double compliance = 0;
};

// -(c v + tau_c tanh(v / v_s)) along a row whose rate is v: viscous and Coulomb friction, the latter smooth about rest.
struct Friction {
  double viscous = 0, coulomb = 0, speed = 1;

  double resistance(double rate) const { return viscous * rate + coulomb * std::tanh(rate / speed); }
  double slope(double rate) const { // of the resistance
    const double steady = std::cosh(rate / speed);
    return viscous + coulomb / (speed * steady * steady);
  }
  bool acts() const { return viscous != 0 || coulomb != 0; }
};

// Generalized force `size(t)` along a row: joint moments, point forces, with the same directions as constraints.
struct Drive {
  Measure row;
  TimeFunction size;
  Friction friction = {};
};

// Spring and damper of a gear: the moment k delta + c delta_dot, delta = motor - joint, pulls the motor back and the
// joint along. Both rows are angles, which do not move with the bodies.
struct Spring {
  Measure motor, joint;
  double stiffness = 0, damping = 0;

  double moment(const MeasureMotion &of_motor, const MeasureMotion &of_joint) const {
    return stiffness * (of_motor.value - of_joint.value) + damping * (of_motor.rate - of_joint.rate);
  }
};

// Modal forces `vector * size(t)` on one body: PZT patches.
struct ModalDrive {
  int body;
  Eigen::VectorXd vector;
  TimeFunction size;
};

struct System {
  Eigen::Vector2d gravity = Eigen::Vector2d::Zero();
  std::vector<PlanarBody> bodies;
  std::vector<Constraint> constraints; // ordered for a small envelope by whoever builds the system, rotors last
  std::vector<Drive> drives;
  std::vector<Spring> springs;
  std::vector<ModalDrive> modal_drives;
  std::vector<StateForce> state_forces;

  // Derived from the above by finish()
  std::vector<Eigen::Index> first_coordinate; // of each body in q
  Eigen::Index coordinates = 0;
  double length = 0;                  // of the bodies, in whatever unit: what positions are compared with
  std::size_t held = 0;               // constraints that are no rotors
  std::vector<Eigen::Index> envelope; // first column of each row of C M^-1 C^T
  struct Coupling {                   // constraint rows r >= s meet on a body at markers k and l
    int r, s, body, k, l;
    bool r_is_b, s_is_b;
  };
  std::vector<Coupling> couplings;

  void finish();
};

struct Workspace {
  explicit Workspace(const System &system);

  std::vector<PlanarBodyState> bodies;
  // Of the constraints, at the last evaluation; values and rates only where coefficients move.
  std::vector<MeasureMotion> rows;
  std::vector<MeasureMotion> drive_rows;
  std::vector<Jet> targets; // of the constraints at target_time
  double target_time = std::numeric_limits<double>::quiet_NaN();
  std::vector<double> external_drive;          // added to the drives' own sizes; set by whoever steers the system
  std::vector<Eigen::VectorXd> external_modal; // likewise, modal forces of each body
  bool has_external_modal = false;
  EnvelopeMatrix<double> schur; // C M^-1 C^T, factorised
  PortCouplings ports;
  Eigen::VectorXd lambda;
  std::vector<Eigen::Matrix3Xd> wrench;    // scratch: on the markers of each body
  Eigen::VectorXd correction, value, rate; // of projections
  unsigned long evaluations = 0;
};

// Accelerations a (coordinates) and multipliers workspace.lambda at time t.
void accelerations(const System &system, double t, const double *q, const double *v, Workspace &w, double *a);

// Values C and rates C_dot of all constraints; refreshes the kinematics but neither mass matrix nor coefficients.
void constraint_residuals(const System &system, double t, const double *q, const double *v, Workspace &w, double *value,
                          double *rate);

// Largest violation of C_ddot = 0 by the accelerations a, relative to the terms that cancel in it. Computed from a
// alone, not from the elimination that made it. At the coordinates of the last evaluation.
double acceleration_residual(const System &system, const double *q, const double *a, const Workspace &w);

// Moves q and v onto C = 0 and C_dot = 0 in the mass metric, by Newton steps on the last factorisation where it
// is good enough and a fresh one otherwise. Returns the largest residual left, relative to 1 m, 1 rad, 1 m/s.
double project(const System &system, double t, double *q, double *v, Workspace &w);

// Generalized forces of gravity, elasticity and drives on all coordinates, at rest.
void static_force(const System &system, double t, const double *q, Workspace &w, double *Q);

// f = M a - Q (coordinates): what constraints and actuators must supply for the accelerations a, drives taken off.
void required_force(const System &system, double t, const double *q, const double *v, const double *a, Workspace &w,
                    double *f);

// Positions and velocities of all markers.
void update_kinematics(const System &system, const double *q, const double *v, Workspace &w);

// Acceleration of any row's value, without its target. Uses kinematics in w and the row's motion there.
double row_acceleration(const System &system, const Measure &row, const MeasureMotion &motion, const double *q,
                        const double *a, const Workspace &w);

// Accelerations C_ddot (constraints, rotors too) for accelerations a of the coordinates. Uses kinematics, rows and
// targets in w.
void constraint_accelerations(const System &system, const double *q, const double *a, const Workspace &w, double *c);

// C_q (held constraints x coordinates), dense, at the coordinates of the last evaluation.
Eigen::MatrixXd constraint_jacobian(const System &system, const Workspace &w);

// Energies of rotors and springs and the power that friction and dampers take, at the state (q, v).
struct JointEnergy {
  double kinetic = 0, strain = 0, dissipated_power = 0;
};
JointEnergy joint_energy(const System &system, const double *q, const double *v, Workspace &w);

} // namespace ffrobot
