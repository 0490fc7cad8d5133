// Gradients of constraint equations by coordinates: what they measure of unit velocities.
#pragma once

#include "core/recursion/constrained_aba/workspace.h"

#include <Eigen/Core>

#include <vector>

namespace ffrobot::recursion {

// Columns of C_q (constraints, coordinates) at q (n_q), of these entries of v; the kinematics in `w` are of another
// state afterwards.
template <class Space>
Eigen::MatrixXd gradients(const Mechanism<Space> &m, const double *q, const std::vector<int> &coordinates,
                          Workspace<Space, double> &w) {
  const auto rows = static_cast<Eigen::Index>(m.constraints.size());
  Eigen::VectorXd v = Eigen::VectorXd::Zero(m.n_v), value(rows), at_rest = Eigen::VectorXd::Zero(rows);
  if (m.has_moving_constraints) // markers that turn have a rate of their own
    measure(m, q, v.data(), w, value.data(), at_rest.data());
  Eigen::MatrixXd found(rows, static_cast<Eigen::Index>(coordinates.size()));
  Eigen::Index column = 0;
  for (const int i : coordinates) {
    v[i] = 1;
    measure(m, q, v.data(), w, value.data(), found.col(column).data());
    found.col(column++) -= at_rest;
    v[i] = 0;
  }
  return found;
}

} // namespace ffrobot::recursion
