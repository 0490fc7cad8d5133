#include "core/actuation.h"

namespace ffrobot {

using Eigen::Index;

ActuationResolver::ActuationResolver(const System &system, std::vector<bool> trajectory, std::vector<Row> motors)
    : system_(system), trajectory_(std::move(trajectory)), motors_(std::move(motors)), motor_rows_(motors_.size()),
      gradient_(system.coordinates) {
  const auto size = static_cast<Index>(3 * system.bodies.size());
  joint_system_ = Eigen::MatrixXd::Zero(size, size);
  rhs_ = solution_ = Eigen::VectorXd::Zero(size);
  lu_ = Eigen::PartialPivLU<Eigen::MatrixXd>(size);
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

// The same for a unit force along one row
void add_row(const Workspace &w, const Row &row, const RowMotion &motion, Eigen::Ref<Eigen::VectorXd> Q) {
  const auto add = [&](const MarkerReference &m, const Eigen::Vector3d &f) {
    if (m.body < 0)
      return;
    const auto &arm = w.bodies[static_cast<std::size_t>(m.body)].markers[static_cast<std::size_t>(m.marker)].arm;
    Q[3 * m.body] += f[0];
    Q[3 * m.body + 1] += f[1];
    Q[3 * m.body + 2] += arm.x() * f[1] - arm.y() * f[0] + f[2];
  };
  add(row.a, motion.coefficient_a);
  add(row.b, motion.coefficient_b);
}

} // namespace

void ActuationResolver::resolve(const Workspace &w) {
  for (auto &wrench : wrench_)
    wrench.setZero();
  joint_system_.setZero();
  Index column = 0;
  for (std::size_t r = 0; r < trajectory_.size(); ++r) {
    const Row &row = system_.constraints[r].row;
    if (trajectory_[r])
      add_wrench(row, w.rows[r], -w.lambda[static_cast<Index>(r)], wrench_);
    else
      add_row(w, row, w.rows[r], joint_system_.col(column++));
  }
  for (std::size_t i = 0; i < motors_.size(); ++i) {
    evaluate(motors_[i], w.bodies, motor_rows_[i]);
    add_row(w, motors_[i], motor_rows_[i], joint_system_.col(column++));
  }
  rhs_.setZero();
  resultant(system_, w, wrench_, rhs_);
  lu_.compute(joint_system_);
  solution_ = lu_.solve(rhs_);

  column = 0;
  for (std::size_t r = 0; r < trajectory_.size(); ++r)
    if (!trajectory_[r])
      add_wrench(system_.constraints[r].row, w.rows[r], -solution_[column++], wrench_);
  for (std::size_t i = 0; i < motors_.size(); ++i) {
    tau_[static_cast<Index>(i)] = solution_[column];
    add_wrench(motors_[i], motor_rows_[i], -solution_[column++], wrench_);
  }
  for (std::size_t b = 0; b < system_.bodies.size(); ++b) {
    F_p_[b].setZero();
    add_modal_force(system_.bodies[b], w.bodies[b], wrench_[b], F_p_[b]);
  }
}

} // namespace ffrobot
