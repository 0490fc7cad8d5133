#include "core/actuation/actuator_forces.h"

namespace ffrobot {

using Eigen::Index;

ActuatorForces::ActuatorForces(const System &system, std::vector<bool> trajectory, std::vector<Measure> motors)
    : system_(system), trajectory_(std::move(trajectory)), motors_(std::move(motors)), motor_rows_(motors_.size()),
      joint_system_(static_cast<Index>(system.bodies.size())) {
  rhs_ = solution_ = Eigen::VectorXd::Zero(static_cast<Index>(3 * system.bodies.size()));
  tau_ = Eigen::VectorXd::Zero(static_cast<Index>(motors_.size()));
  for (const auto &body : system.bodies) {
    F_p_.emplace_back(Eigen::VectorXd::Zero(body.modes()));
    wrench_.emplace_back(Eigen::Matrix3Xd::Zero(3, body.markers()));
  }
}

namespace {

// (Force, moment about the frame's origin) of wrenches on the markers, for each body
void resultant(const System &system, const Workspace &w, const std::vector<Eigen::Matrix3Xd> &wrench,
               Eigen::Ref<Eigen::VectorXd> Q) {
  for (std::size_t b = 0; b < system.bodies.size(); ++b)
    for (Index k = 0; k < wrench[b].cols(); ++k) {
      const auto f = wrench[b].col(k);
      const auto &arm = w.bodies[b].markers[static_cast<std::size_t>(k)].arm;
      const auto i = static_cast<Index>(3 * b);
      Q[i] += f[0];
      Q[i + 1] += f[1];
      Q[i + 2] += arm.x() * f[1] - arm.y() * f[0] + f[2];
    }
}

} // namespace

const Eigen::VectorXd &ActuatorForces::tau_of(const Eigen::VectorXd &lambda, const Workspace &w) {
  for (auto &wrench : wrench_)
    wrench.setZero();
  Index column = 0;
  for (std::size_t r = 0; r < trajectory_.size(); ++r)
    if (trajectory_[r])
      add_wrench(system_.rows[r], w.rows[r], -lambda[static_cast<Index>(r)], wrench_);
    else
      joint_system_.set_column(column++, system_.rows[r], w.rows[r], w.bodies);
  for (std::size_t i = 0; i < motors_.size(); ++i) {
    evaluate(motors_[i], w.bodies, motor_rows_[i]);
    joint_system_.set_column(column++, motors_[i], motor_rows_[i], w.bodies);
  }
  rhs_.setZero();
  resultant(system_, w, wrench_, rhs_);
  joint_system_.factorise();
  solution_ = joint_system_.solve(rhs_);
  tau_ = solution_.tail(tau_.size());
  return tau_;
}

void ActuatorForces::resolve(const Workspace &w) {
  tau_of(w.lambda, w);
  Index column = 0;
  for (std::size_t r = 0; r < trajectory_.size(); ++r)
    if (!trajectory_[r])
      add_wrench(system_.rows[r], w.rows[r], -solution_[column++], wrench_);
  for (std::size_t i = 0; i < motors_.size(); ++i)
    add_wrench(motors_[i], motor_rows_[i], -solution_[column++], wrench_);
  for (std::size_t b = 0; b < system_.bodies.size(); ++b) {
    F_p_[b].setZero();
    add_modal_force(system_.bodies[b], w.bodies[b], wrench_[b], F_p_[b]);
  }
}

} // namespace ffrobot
