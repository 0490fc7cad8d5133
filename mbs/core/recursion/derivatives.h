// How accelerations and rows answer to small changes of a state, exact: dual numbers through the recursion, eight
// directions at a time.
#pragma once

#include "core/recursion/cut.h"
#include "core/recursion/point_force.h"

#include <Eigen/Core>

namespace ffrobot::recursion {

// By increments of q (n_v; rotation vectors in body axes for quaternions), by v and by generalized forces; rows hold.
struct Derivatives {
  Eigen::MatrixXd a_q, a_v, a_f;      // (n_v, n_v) of accelerations
  Eigen::MatrixXd lambda_q, lambda_v; // (rows, n_v) of multipliers, 0 of rows that are not kept
  Eigen::MatrixXd value_q;            // (rows, n_v) of values of rows, C_q: by v of their rates, too
  Eigen::MatrixXd rate_q;             // (rows, n_v) of their rates
};

// What changes with q and v where sections move: joints at which loops are cut, with the loads that are given along
// them (N m, N, as many), and forces at points at time t. `length` (m): see add_at_points().
struct AtSections {
  const std::vector<CutJoint> &joints;
  const double *loads;
  const std::vector<PointForce> &points;
  double t, length;
};

// At q, v under `forces`, those `at` sections and second derivatives `target` (rows) of the rows that `kept` keeps;
// markers of the ground stand and turn as there.
template <class Space>
Derivatives derivatives(const Mechanism<Space> &m, const Workspace<Space, double> &kept, const double *q,
                        const double *v, const Forces<double> &forces, const AtSections &at, const double *target);

} // namespace ffrobot::recursion
