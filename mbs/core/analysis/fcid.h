// Fully constrained inverse dynamics: the modal coordinates are prescribed too, so that everything is algebraic.
#pragma once

#include "core/actuation/actuator_forces.h"
#include "core/analysis/prescribed_motion.h"
#include "core/system/frame_system.h"
#include "core/system/system.h"

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <vector>

namespace ffrobot {

// C_m = 0, C_s = 0 and p = p(t) are as many equations as coordinates (Shaban 2022, sec. 5.1). With p known, (R, theta)
// follow from C = 0, and their rates and accelerations from linear equations in the same matrix C_q,r; then
//
//     C_q,r^T lambda = -f_r,   -lambda_p = f_p + C_q,p^T lambda        with f = M q_ddot - Q
//
// give the forces that hold trajectories and shape. Needs as many constraints as the frames have coordinates.
class FullyConstrained {
public:
  // guess: coordinates from which the first position is found; later ones start at the one before.
  FullyConstrained(const System &system, Eigen::VectorXd guess);

  // The next position is found from the frames of q, without looking at the last one.
  void start_at(const Eigen::VectorXd &q);

  // Shape p, p_dot, p_ddot at time t: fills the modal part of q, v, a.
  void set_shape(double t, const std::vector<ModalShape> &shape);
  void set_shape(const Eigen::VectorXd &p); // of all bodies, at rest
  void set_shape(const Eigen::VectorXd &p, const Eigen::VectorXd &p_dot, const Eigen::VectorXd &p_ddot);

  // The target of a constraint at time t, in place of its own in the solve(t) that follows. Once one is given, so have
  // to be all that are not zero.
  void set_target(double t, std::size_t constraint, const Jet &target);

  // The motion of the frames and all forces, for the shape that was set. False where no position is found.
  bool solve(double t);
  bool move(double t);    // the motion alone
  void balance(double t); // the forces of that motion

  const Eigen::VectorXd &q() const { return q_; }
  const Eigen::VectorXd &v() const { return v_; }
  const Eigen::VectorXd &a() const { return a_; }
  const System &system() const { return system_; }
  const Workspace &workspace() const { return workspace_; }                        // lambda, rows, kinematics
  const std::vector<Eigen::VectorXd> &shape_force() const { return shape_force_; } // -lambda_p of each body
  const Eigen::VectorXd &position_residual() const { return value_; }
  const Eigen::VectorXd &velocity_residual() const { return rate_; }

private:
  bool find_position(double t);
  const Eigen::VectorXd &frame_step(const Eigen::VectorXd &rhs);
  void update_jacobian();
  void add_rotors(Eigen::VectorXd &f_r);

  const System &system_;
  Workspace workspace_;
  Eigen::VectorXd q_, v_, a_, f_, step_, value_, rate_, acceleration_;
  FrameSystem gradients_; // C_q,r^T
  double time_ = 0;
  bool started_ = false;
  std::vector<Eigen::VectorXd> shape_force_;
};

// What FCID reports, one row per time that was reached.
struct FcidOutputs {
  bool completed = true;
  std::size_t reached = 0;
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> q, v, a, lambda, shape_force, tau, F_p,
      residual;
};

// What is reported of `motion` at `times`; solve(t) makes it that of time t. actuator_forces may be null; F_p then
// stays empty.
FcidOutputs collect(const FullyConstrained &motion, const std::vector<double> &times,
                    const std::function<bool(double)> &solve, ActuatorForces *actuator_forces);

// actuator_forces may be null, as above.
FcidOutputs fully_constrained(const System &system, const std::vector<double> &times,
                              const std::vector<ModalShape> &shape, const Eigen::VectorXd &guess,
                              ActuatorForces *actuator_forces);

// The shape in which the links, at rest relative to their frames, need no modal forces beside those of motors and
// joints (of the trajectory forces without a actuator_forces): they sag under gravity and inertia as they would by
// themselves. Rows p of all bodies, one per time; fewer where the iteration p <- p - K^-1 F_p(p) does not converge.
Eigen::MatrixXd static_shape(const System &system, const std::vector<double> &times, const Eigen::VectorXd &guess,
                             ActuatorForces *actuator_forces);

} // namespace ffrobot
