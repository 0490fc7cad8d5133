// A system of bodies under constraints: C(q, t) = 0, M q_ddot + C_q^T lambda = Q.
//
// System holds constants, Workspace everything that changes; algorithms are free functions of both.
#pragma once

#include "core/envelope.h"
#include "core/planar_body.h"
#include "core/port_couplings.h"
#include "core/rows.h"
#include "core/time_function.h"

#include <limits>
#include <vector>

namespace ffrobot {

// C = row - target(t) = 0
struct Constraint {
  Row row;
  TimeFunction target;
};

// Generalized force `size(t)` along a row: joint moments, point forces, with the same directions as constraints.
struct Drive {
  Row row;
  TimeFunction size;
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
  std::vector<Constraint> constraints; // ordered for a small envelope by whoever builds the system
  std::vector<Drive> drives;
  std::vector<ModalDrive> modal_drives;

  // Derived from the above by finish()
  std::vector<Eigen::Index> first_coordinate; // of each body in q
  Eigen::Index coordinates = 0;
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
  std::vector<RowMotion> rows;
  std::vector<RowMotion> drive_rows;
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

// Accelerations C_ddot (constraints) for accelerations a of the coordinates. Uses kinematics, rows and targets in w.
void constraint_accelerations(const System &system, const double *q, const double *a, const Workspace &w, double *c);

// C_q (constraints x coordinates), dense, at the coordinates of the last evaluation.
Eigen::MatrixXd constraint_jacobian(const System &system, const Workspace &w);

} // namespace ffrobot
