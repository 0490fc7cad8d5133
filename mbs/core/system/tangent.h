// Exact derivatives of the equations of motion F = M a - Q + C_q^T lambda = 0 and of rows, from formulas.
//
// The linear equations of a motion (q, v, a, lambda) are
//     M da + D dv + K dq + C_q^T dlambda = dQ of the inputs,     D = -dQ/dv,  K = dF/dq at fixed lambda and drives.
#pragma once

#include "core/system/system.h"

#include <Eigen/Core>
#include <vector>

namespace ffrobot {

struct Tangent {
  explicit Tangent(Eigen::Index n_v) : M(Eigen::MatrixXd::Zero(n_v, n_v)), D(M), K(M), force(n_v) {}

  Eigen::MatrixXd M, D, K; // (n_v, n_v)
  Eigen::VectorXd force;   // M a - Q (n_v), drives taken off
};

// Derivatives of the accelerations of rows (rows, n_v): row_ddot = by_acceleration a + ...; the first is the
// Jacobian of the rows' values too, and by_velocity is twice the derivative of row_dot with respect to q.
struct RowTangents {
  RowTangents(Eigen::Index rows, Eigen::Index n_v)
      : by_acceleration(rows, n_v), by_velocity(rows, n_v), by_position(rows, n_v) {}

  Eigen::MatrixXd by_acceleration, by_velocity, by_position;
};

// M, D, K and the force of the bodies, and of the drives (external ones too) as they are at time t.
// Leaves the kinematics of (q, v) in w, on which the functions below rest.
void tangent(const System &system, double t, const double *q, const double *v, const double *a, Workspace &w,
             Tangent &result);

// K += multiplier d2(row)/dq2: what a force -multiplier along the row adds. After tangent.
void add_row_curvature(const System &system, const Measure &row, double multiplier, const Workspace &w,
                       Eigen::Ref<Eigen::MatrixXd> K);

// Measure i of `result`. After tangent, or anything else that sets the kinematics of (q, v).
void row_tangent(const System &system, const Measure &row, const double *q, const double *v, const double *a,
                 const Workspace &w, Eigen::Index i, RowTangents &result);

} // namespace ffrobot
