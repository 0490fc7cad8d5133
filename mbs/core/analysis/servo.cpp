#include "core/analysis/servo.h"

#include <algorithm>
#include <cmath>

namespace ffrobot {

using Eigen::Index;
using Eigen::VectorXd;

ServoConstraint::ServoConstraint(const System &path, std::vector<Measure> motors, const System &driven,
                                 std::vector<std::size_t> motor_constraint, double factor,
                                 std::vector<TimeFunction> offset, std::vector<double> near_times, RowMajorMatrix near)
    : path_system_(path), driven_system_(driven), motors_(std::move(motors)),
      motor_constraint_(std::move(motor_constraint)), factor_(factor), offset_(std::move(offset)),
      near_times_(std::move(near_times)), near_(std::move(near)), path_(path, near_.row(0)),
      driven_(driven, near_.row(0)) {
  residual_ = p_ = p_dot_ = p_ddot_ = VectorXd::Zero(path.n_modes());
}

bool ServoConstraint::move(double t) {
  const auto away = [t](double time) { return std::abs(time - t); };
  const auto nearest = std::min_element(near_times_.begin(), near_times_.end(),
                                        [&](double one, double other) { return away(one) < away(other); });
  const bool goes_on = away(found_at_) <= away(*nearest);
  if (!goes_on)
    path_.start_at(near_.row(nearest - near_times_.begin()));
  bool found = path_.move(t);
  if (!found && !goes_on && std::isfinite(found_at_)) { // links that are bent far are nearer to the last position
    path_.start_at(last_);
    found = path_.move(t);
  }
  found_at_ = found ? t : std::nan("");
  if (found)
    last_ = path_.q();
  return found;
}

bool ServoConstraint::solve(double t, const VectorXd &p, const VectorXd &p_dot, const VectorXd &p_ddot) {
  output_p_ = factor_ * p;
  output_p_dot_ = factor_ * p_dot;
  output_p_ddot_ = factor_ * p_ddot;
  for (std::size_t k = 0; k < offset_.size(); ++k) {
    const Jet offset = offset_[k](t);
    const auto i = static_cast<Index>(k);
    output_p_[i] += offset.value;
    output_p_dot_[i] += offset.rate;
    output_p_ddot_[i] += offset.acceleration;
  }
  path_.set_shape(output_p_, output_p_dot_, output_p_ddot_);
  if (!move(t))
    return false;
  const Workspace &w = path_.workspace();
  MeasureMotion motion;
  for (std::size_t i = 0; i < motors_.size(); ++i) {
    evaluate(motors_[i], w.bodies, motion);
    const double acceleration =
        row_acceleration(path_system_, motors_[i], motion, path_.q().data(), path_.a().data(), w);
    driven_.set_target(t, motor_constraint_[i], {motion.value, motion.rate, acceleration});
  }
  driven_.start_at(path_.q()); // the very same frames where factor = 1
  driven_.set_shape(p, p_dot, p_ddot);
  if (!driven_.solve(t))
    return false;
  Index column = 0;
  for (const auto &force : driven_.shape_force()) {
    residual_.segment(column, force.size()) = force;
    column += force.size();
  }
  return true;
}

bool ServoConstraint::solve(double t, const std::vector<ModalShape> &shape) {
  Index k = 0;
  for (const auto &of_body : shape)
    for (const auto &function : of_body) {
      const Jet p = function(t);
      p_[k] = p.value;
      p_dot_[k] = p.rate;
      p_ddot_[k++] = p.acceleration;
    }
  return solve(t, p_, p_dot_, p_ddot_);
}

namespace {

// r at one node; NaN where no position is found
VectorXd residual(ServoConstraint &servo, double t, const VectorXd &p, const VectorXd &p_dot, const VectorXd &p_ddot) {
  if (servo.solve(t, p, p_dot, p_ddot))
    return servo.residual();
  return VectorXd::Constant(servo.modes(), std::nan(""));
}

} // namespace

RowMajorMatrix servo_residuals(ServoConstraint &servo, const std::vector<double> &times, const RowMajorMatrix &p,
                               const RowMajorMatrix &p_dot, const RowMajorMatrix &p_ddot) {
  RowMajorMatrix r(p.rows(), p.cols());
  servo.restart();
  for (Index i = 0; i < p.rows(); ++i)
    r.row(i) = residual(servo, times[static_cast<std::size_t>(i)], p.row(i), p_dot.row(i), p_ddot.row(i)).transpose();
  return r;
}

InternalDynamics servo_derivatives(ServoConstraint &servo, const std::vector<double> &times, const RowMajorMatrix &p,
                                   const RowMajorMatrix &p_dot, const RowMajorMatrix &p_ddot) {
  constexpr double step = 1e-5;
  const Index N = p.rows(), n = p.cols();
  InternalDynamics d{{N, n * n}, {N, n * n}, {N, n * n}};
  servo.restart();
  for (Index i = 0; i < N; ++i) {
    const double t = times[static_cast<std::size_t>(i)];
    VectorXd x[] = {p.row(i), p_dot.row(i), p_ddot.row(i)};
    const auto difference = [&](RowMajorMatrix &to, VectorXd &of, double h) {
      Eigen::Map<RowMajorMatrix> matrix(to.row(i).data(), n, n);
      for (Index k = 0; k < n; ++k) {
        const double middle = of[k];
        of[k] = middle + h;
        const VectorXd up = residual(servo, t, x[0], x[1], x[2]);
        of[k] = middle - h;
        matrix.col(k) = (up - residual(servo, t, x[0], x[1], x[2])) / (2 * h);
        of[k] = middle;
      }
    };
    residual(servo, t, x[0], x[1], x[2]); // the position that the others start at
    difference(d.K, x[0], step);
    difference(d.D, x[1], 1.0);
    difference(d.M, x[2], 1.0);
  }
  return d;
}

FcidOutputs servo_outputs(ServoConstraint &servo, const std::vector<double> &times,
                          const std::vector<ModalShape> &shape, ActuatorForces &actuator_forces) {
  servo.restart();
  return collect(servo.motion(), times, [&](double t) { return servo.solve(t, shape); }, &actuator_forces);
}

ServoActuation::ServoActuation(const System &driven, ServoConstraint servo, std::vector<ModalShape> shape,
                               std::vector<bool> is_motor, ActuatorForces actuator_forces)
    : SystemSource(driven, std::move(is_motor), std::move(actuator_forces)), servo_(std::move(servo)),
      shape_(std::move(shape)) {}

void ServoActuation::find(double t) {
  servo_.solve(t, shape_); // was found at all output times before; a failure in between shows as a refused step
  resolve();
}

} // namespace ffrobot
