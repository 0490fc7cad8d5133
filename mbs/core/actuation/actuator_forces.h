// What motors and modal forces must do in place of the forces that hold a trajectory.
#pragma once

#include "core/system/frame_system.h"
#include "core/system/motion.h"

#include <vector>

namespace ffrobot {

// Q_a = -C_sq^T lambda_s (Shaban 2022, Eq. 13 and below) written as motor forces tau along the motor rows, forces nu
// of the mechanical joints (which do no work) and modal forces F_p:
//
//     -C_sq^T lambda_s = C_mq^T nu + T_q^T tau + (0, 0, F_p)
//
// This is F_je = -D^T C_sq^T lambda_s (Eq. 21) with D eliminated: its (R, theta) rows give nu and tau, its p rows F_p.
class ActuatorForces final : public ForcesOfMotors {
public:
  // trajectory[i]: whether constraint i is a specified trajectory (C_s) or a mechanical joint (C_m).
  // Needs as many motors as the mechanism with rigid links has degrees of freedom.
  ActuatorForces(const System &system, std::vector<bool> trajectory, std::vector<Measure> motors);

  // After accelerations(): uses the kinematics and multipliers in w.
  void resolve(const Workspace &w);

  const std::vector<Measure> &motors() const override { return motors_; }
  const Eigen::VectorXd &tau_of(const Eigen::VectorXd &lambda, const Workspace &w) override;

  const Eigen::VectorXd &tau() const { return tau_; }                      // (motors)
  const std::vector<Eigen::VectorXd> &modal_force() const { return F_p_; } // of each body

private:
  const System &system_;
  std::vector<bool> trajectory_;
  std::vector<Measure> motors_;
  std::vector<MeasureMotion> motor_rows_;
  Eigen::VectorXd rhs_, solution_, tau_;
  FrameSystem joint_system_; // columns: joints, then motors
  std::vector<Eigen::VectorXd> F_p_;
  std::vector<Eigen::Matrix3Xd> wrench_;
};

} // namespace ffrobot
