// How accelerations and constraints answer to small changes of a state, exact: dual numbers through the recursion,
// eight directions at a time.
#pragma once

#include "core/recursion/constrained_aba/loop_joint.h"
#include "core/recursion/constrained_aba/point_force.h"

#include <Eigen/Core>

namespace ffrobot::recursion {

// By increments of q (n_v; rotation vectors in body axes for quaternions), by v and by generalized forces; constraints
// hold.
struct Derivatives {
  Eigen::MatrixXd a_q, a_v, a_f;      // (n_v, n_v) of accelerations
  Eigen::MatrixXd lambda_q, lambda_v; // (constraints, n_v) of multipliers, 0 of constraints that are not kept
  Eigen::MatrixXd value_q;            // (constraints, n_v) of values of constraints, C_q: by v of their rates, too
  Eigen::MatrixXd rate_q;             // (constraints, n_v) of their rates
};

// What changes with q and v where sections move: joints at which loops are cut, with the loads that are given along
// them (N m, N, as many), and forces at points at time t. `length` (m): see add_at_points().
struct AtSections {
  const std::vector<CutJoint> &joints;
  const double *loads;
  const std::vector<PointForce> &points;
  double t, length;
};

// At q, v under `forces`, those `at` sections and second derivatives `target` (constraints) of the constraints that
// `kept` keeps; markers of the ground stand and turn as there. By forces only if asked for.
template <class Space>
Derivatives derivatives(const Mechanism<Space> &m, const Workspace<Space, double> &kept, const double *q,
                        const double *v, const Forces<double> &forces, const AtSections &at, const double *target,
                        bool by_forces);

} // namespace ffrobot::recursion
