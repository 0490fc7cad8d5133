// Actuation points: generalized forces of one body as forces at points of it (Shabana 2022, Eqs. 5-10).
#pragma once

#include "core/system/system.h"

#include <Eigen/LU>
#include <Eigen/QR>
#include <vector>

namespace ffrobot {

// The force -lambda_s on a trajectory, constraint by constraint.
struct TrajectoryForce {
  std::size_t constraint;
  double force; // N, N m
};

// Q_a = -C_sq^T lambda_s - (0, 0, lambda_p) on (R, theta, p) of one body, at the kinematics of w.
Eigen::VectorXd driving_force(const System &system, const Workspace &w, const std::vector<TrajectoryForce> &forces,
                              const Eigen::VectorXd &shape_force, std::size_t body);

// Components of force at points, along axes of the body frame: L_a F_a = Q_a (Eq. 9), where the column of a component
// along e at the point x is, with R in body axes,
//
//     [e; e . u_perp; Phi_e^T],     u = x + Phi(x) p
//
// As many components as coordinates: solved as it stands. Otherwise least squares of the scaled equations (Eq. 10).
class ActuationPoints {
public:
  // direction, position: (2, c); Phi: (2 c, n), rows Phi_x, Phi_y of each point; scale: (3 + n) of the rows of L_a.
  ActuationPoints(Eigen::Matrix2Xd direction, Eigen::Matrix2Xd position, Eigen::MatrixXd Phi, Eigen::VectorXd scale);

  Eigen::Index count() const { return direction_.cols(); }
  const Eigen::MatrixXd &L_a(const Eigen::Ref<const Eigen::VectorXd> &p); // (3 + n, c), R in body axes

  // F_a (c) for Q_a with R in global axes.
  const Eigen::VectorXd &solve(double theta, const Eigen::Ref<const Eigen::VectorXd> &p, Eigen::VectorXd Q_a);
  Eigen::Vector2d global_force(double theta, Eigen::Index component) const; // of the last solve

private:
  Eigen::Matrix2Xd direction_, position_;
  Eigen::MatrixXd Phi_, L_a_, scaled_;
  Eigen::VectorXd scale_, F_a_;
  Eigen::PartialPivLU<Eigen::MatrixXd> lu_;
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr_;
};

} // namespace ffrobot
