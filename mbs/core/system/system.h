// A system of bodies under constraints: C(q, t) = 0, M q_ddot + C_q^T lambda = Q.
//
// System holds constants, Workspace everything that changes; algorithms are free functions of both.
#pragma once

#include "core/body/planar_body.h"
#include "core/constraint/constraint.h"
#include "core/constraint/envelope.h"
#include "core/constraint/port_couplings.h"
#include "core/constraint/state_force.h"
#include "core/space/configuration_space.h"

#include <limits>
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
  std::vector<Constraint> constraints; // the caller orders them for a small envelope of C M^-1 C^T
  std::vector<Rotor> rotors;
  std::vector<Drive> drives;
  std::vector<Spring> springs;
  std::vector<ModalDrive> modal_drives;
  std::vector<StateForce> state_forces;

  // Derived from the above by finish()
  ConfigurationSpace space;                   // of q, with its lengths n_q and n_v
  std::vector<Eigen::Index> first_coordinate; // of each body, whose coordinates are numbers, in q and in v
  double length = 0;                          // m, of the bodies: what positions are compared with
  std::vector<Measure> rows;                  // of all constraints, then of all rotors: those of multipliers
  std::vector<Eigen::Index> envelope;         // first column of each row of C M^-1 C^T
  struct Coupling {                           // constraint rows r >= s meet on a body at markers k and l
    int r, s, body, k, l;
    bool r_is_b, s_is_b;
  };
  std::vector<Coupling> couplings;

  Eigen::Index n_q() const { return space.n_q(); }
  Eigen::Index n_v() const { return space.n_v(); }
  Eigen::Index n_modes() const;                                  // of all bodies
  std::size_t n_bilateral() const { return constraints.size(); } // the first of the rows

  void finish();

private:
  void find_used_markers();
  void find_couplings();
};

struct Workspace {
  explicit Workspace(const System &system);

  std::vector<PlanarBodyState> bodies;
  // Of the system's rows at the last evaluation; values and rates only where coefficients move.
  std::vector<MeasureMotion> rows;
  std::vector<MeasureMotion> drive_rows;
  std::vector<Jet> targets; // of the system's rows at target_time; zero for rotors
  double target_time = std::numeric_limits<double>::quiet_NaN();
  std::vector<double> external_drive;          // of ExternalLoads, added to the magnitudes of the drives
  std::vector<Eigen::VectorXd> external_modal; // likewise, modal forces of each body
  bool has_external_modal = false;
  EnvelopeMatrix<double> schur; // C M^-1 C^T, factorised
  PortCouplings ports;
  Eigen::VectorXd lambda;                  // of the system's rows: N along a length, N m about an angle
  std::vector<Eigen::Matrix3Xd> wrench;    // scratch: on the markers of each body
  Eigen::VectorXd correction, value, rate; // of projections
  unsigned long evaluations = 0;
};

// Below: q (n_q), v, a and generalized forces (n_v), values of rows (constraints, then rotors).

// Accelerations a and multipliers workspace.lambda at time t.
void accelerations(const System &system, double t, const double *q, const double *v, Workspace &w, double *a);

// Values C and rates C_dot of all rows, zero for rotors; refreshes the kinematics but neither mass matrix nor
// coefficients.
void constraint_residuals(const System &system, double t, const double *q, const double *v, Workspace &w, double *value,
                          double *rate);

// Largest violation of C_ddot = 0 by the accelerations a, relative to the terms that cancel in it. Computed from a
// alone, not from the elimination that made it. At the coordinates of the last evaluation.
double acceleration_residual(const System &system, const double *q, const double *a, const Workspace &w);

// Moves q and v onto C = 0 and C_dot = 0 in the mass metric, by Newton steps on the last factorisation where it
// is good enough and a fresh one otherwise. Returns the largest residual left, relative to 1 m, 1 rad, 1 m/s.
double project(const System &system, double t, double *q, double *v, Workspace &w);

// Generalized forces Q (n_v) of gravity, elasticity and drives, at rest.
void static_force(const System &system, double t, const double *q, Workspace &w, double *Q);

// f = M a - Q (n_v): what constraints and actuators must supply for the accelerations a, drives taken off.
void required_force(const System &system, double t, const double *q, const double *v, const double *a, Workspace &w,
                    double *f);

// Positions and velocities of all markers.
void update_kinematics(const System &system, const double *q, const double *v, Workspace &w);

// Acceleration of any row's value, without its target. Uses kinematics in w and the row's motion there.
double row_acceleration(const System &system, const Measure &row, const MeasureMotion &motion, const double *q,
                        const double *a, const Workspace &w);

// Accelerations C_ddot of all rows for accelerations a. Uses kinematics, rows and
// targets in w.
void constraint_accelerations(const System &system, const double *q, const double *a, const Workspace &w, double *c);

// C_q (constraints, n_v), dense, at the coordinates of the last evaluation.
Eigen::MatrixXd constraint_jacobian(const System &system, const Workspace &w);

// Energies (J) of rotors and springs and the power (W) that friction and dampers take, at the state (q, v).
struct JointEnergy {
  double kinetic = 0, strain = 0, dissipated_power = 0;
};
JointEnergy joint_energy(const System &system, const double *q, const double *v, Workspace &w);

} // namespace ffrobot
