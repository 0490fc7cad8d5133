// Inverse dynamics with motors alone: the path is a servo constraint, whose force enters through the joint motors.
//
//     M q_ddot + C_mq^T nu + T_q^T tau = Q,   C_m(q) = 0,   y_a(q) = path(t)
//
// T: the motors' coordinates, as many as the mechanism with rigid links has degrees of freedom. With p(t) given, all
// frames follow from the constraints; the (R, theta) rows then give nu and tau, and the p rows leave a residual
// r(t, p, p_dot, p_ddot), linear in p_ddot. r = 0 is the internal dynamics (Blajer and Kolodziejczyk 2004; Seifried
// 2014, ch. 4).
//
// The output y_a is where the point would be with the same motor coordinates and the deflections a p + offset(t): the
// point itself with a = 1 and no offset, joint motion alone with a = 0 (Wang and Vidyasagar 1991; De Luca and Siciliano
// 1993). The offset is (1 - a) times the deflections that are expected.
#pragma once

#include "core/analysis/fcid.h"
#include "core/analysis/replay.h"
#include "core/analysis/run.h"

#include <limits>
#include <vector>

namespace ffrobot {

class ServoConstraint {
public:
  // path: under C_m and the specified trajectories; motors: their rows in it. driven: the same bodies under C_m and the
  // motors' rows, motor i being constraint motor_constraint[i]. offset: one function per mode of all bodies, or empty.
  // near: rows q at near_times along the path: a position at t is found from the one found last where that
  // is no further away in time, else from the nearest of these. Both systems must outlive this.
  ServoConstraint(const System &path, std::vector<Measure> motors, const System &driven,
                  std::vector<std::size_t> motor_constraint, double factor, std::vector<TimeFunction> offset,
                  std::vector<double> near_times, RowMajorMatrix near);

  Eigen::Index modes() const { return residual_.size(); }

  // False where no position is found.
  bool solve(double t, const Eigen::VectorXd &p, const Eigen::VectorXd &p_dot, const Eigen::VectorXd &p_ddot);
  bool solve(double t, const std::vector<ModalShape> &shape);
  void restart() { found_at_ = NaN; } // the next position is found from those near it

  const Eigen::VectorXd &residual() const { return residual_; } // r: modal forces that nobody supplies
  const FullyConstrained &motion() const { return driven_; }    // of the robot; its lambda: nu and -tau

private:
  static constexpr double NaN = std::numeric_limits<double>::quiet_NaN();

  bool move(double t);

  const System &path_system_, &driven_system_;
  std::vector<Measure> motors_;
  std::vector<std::size_t> motor_constraint_;
  double factor_;
  std::vector<TimeFunction> offset_;
  std::vector<double> near_times_;
  RowMajorMatrix near_;
  double found_at_ = NaN; // time of the last position
  Eigen::VectorXd last_;  // that position
  Eigen::VectorXd residual_, p_, p_dot_, p_ddot_, output_p_, output_p_dot_, output_p_ddot_;
  FullyConstrained path_, driven_;
};

// r (N, n) at N nodes: times (N), p, p_dot, p_ddot (N, n), all modes of all bodies. NaN where no position is found.
RowMajorMatrix servo_residuals(ServoConstraint &servo, const std::vector<double> &times, const RowMajorMatrix &p,
                               const RowMajorMatrix &p_dot, const RowMajorMatrix &p_ddot);

// Derivatives of r at N nodes, each (N, n n), row after row. r is linear in p_ddot and quadratic in p_dot, so
// differences are exact there but for rounding; by p they are central ones over 1e-5 of a modal coordinate.
struct InternalDynamics {
  RowMajorMatrix M, D, K;
};
InternalDynamics servo_derivatives(ServoConstraint &servo, const std::vector<double> &times, const RowMajorMatrix &p,
                                   const RowMajorMatrix &p_dot, const RowMajorMatrix &p_ddot);

// Motion and forces for p(t), one row per time that was reached; shape_force is the residual.
FcidOutputs servo_outputs(ServoConstraint &servo, const std::vector<double> &times,
                          const std::vector<ModalShape> &shape, ActuatorForces &actuator_forces);

// The motors' forces for p(t), solved anew at every time.
class ServoActuation final : public SystemSource {
public:
  ServoActuation(const System &driven, ServoConstraint servo, std::vector<ModalShape> shape, std::vector<bool> is_motor,
                 ActuatorForces actuator_forces);

private:
  const Workspace &workspace() const override { return servo_.motion().workspace(); }
  const Eigen::VectorXd &q() const override { return servo_.motion().q(); }
  const std::vector<Eigen::VectorXd> &shape_force() const override { return servo_.motion().shape_force(); }
  void find(double t) override;

  ServoConstraint servo_;
  std::vector<ModalShape> shape_;
};

} // namespace ffrobot
