// The linear equations of a motion in independent coordinates s = (values of chosen rows, p of all bodies):
//     M ds_ddot + D ds_dot + K ds = generalized forces on s.
#pragma once

#include "core/system/tangent.h"

#include <Eigen/Core>
#include <Eigen/LU>
#include <vector>

namespace ffrobot {

// Workspace and result of reduce. f: number of independent coordinates.
class Reduction {
public:
  // independent: with the constraints as many rows as the frames have coordinates.
  // Throws std::invalid_argument where that does not hold. Keeps a reference to the system.
  Reduction(const System &system, std::vector<Measure> independent);

  // About a motion (q, v, a) that meets the constraints and their derivatives; external drives as they are in w.
  void reduce(double t, const double *q, const double *v, const double *a, Workspace &w);

  Eigen::MatrixXd M, D, K;          // (f, f)
  Eigen::MatrixXd H, H_dot, H_ddot; // dq/ds (coordinates, f) and its rates along the motion
  Eigen::VectorXd lambda;           // (constraints) of the motion
  Eigen::VectorXd force;            // (f) what drives it: forces along the rows, modal forces
  double reciprocal_condition = 0;  // of the rows' gradients in the frames' coordinates

private:
  void transform();
  void scatter_frames(const Eigen::MatrixXd &frames, Eigen::MatrixXd &into) const;

  const System &system_;
  std::vector<Measure> independent_;
  std::vector<Eigen::Index> frames_, modes_; // numbers of the coordinates (R, theta) and p in q
  Tangent tangent_;
  RowTangents rows_;
  Eigen::MatrixXd G_frames_, G_modes_, right_;
  Eigen::PartialPivLU<Eigen::MatrixXd> lu_;
};

} // namespace ffrobot
