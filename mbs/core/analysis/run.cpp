#include "core/analysis/run.h"

#include "core/actuation/side_by_side.h"

#include <stdexcept>

namespace ffrobot {

using Eigen::Index;

OutputEvaluator::OutputEvaluator(const System &system, std::size_t count, ExternalLoads *external_loads,
                                 ActuatorForces *actuator_forces)
    : system_(system), workspace_(system), external_loads_(external_loads), actuator_forces_(actuator_forces),
      a_(system.n_v()), value_(Eigen::VectorXd::Zero(static_cast<Index>(system.rows.size()))), rate_(value_) {
  const auto T = static_cast<Index>(count);
  outputs_.q.resize(T, system.n_q());
  for (auto *x : {&outputs_.v, &outputs_.a})
    x->resize(T, system.n_v());
  outputs_.lambda.resize(T, value_.size());
  outputs_.residual.resize(T, 3);
  if (actuator_forces) {
    outputs_.tau.resize(T, actuator_forces->tau().size());
    outputs_.F_p.resize(T, system.n_modes());
  }
}

void OutputEvaluator::operator()(std::size_t output, double t, const double *y) {
  const auto i = static_cast<Index>(output);
  q_ = Eigen::Map<const Eigen::VectorXd>(y, system_.n_q());
  v_ = Eigen::Map<const Eigen::VectorXd>(y + system_.n_q(), system_.n_v());
  if (external_loads_)
    external_loads_->apply(t, workspace_);
  accelerations(system_, t, q_.data(), v_.data(), workspace_, a_.data());
  if (!system_.rows.empty()) {
    project(system_, t, q_.data(), v_.data(), workspace_);
    constraint_residuals(system_, t, q_.data(), v_.data(), workspace_, value_.data(), rate_.data());
    outputs_.residual(i, 0) = value_.lpNorm<Eigen::Infinity>() / (1 + q_.lpNorm<Eigen::Infinity>());
    outputs_.residual(i, 1) = rate_.lpNorm<Eigen::Infinity>() / (1 + v_.lpNorm<Eigen::Infinity>());
    accelerations(system_, t, q_.data(), v_.data(), workspace_, a_.data());
    outputs_.residual(i, 2) = acceleration_residual(system_, q_.data(), a_.data(), workspace_);
  } else
    outputs_.residual.row(i).setZero();
  outputs_.q.row(i) = q_.transpose();
  outputs_.v.row(i) = v_.transpose();
  outputs_.a.row(i) = a_.transpose();
  outputs_.lambda.row(i) = workspace_.lambda.transpose();
  if (!actuator_forces_)
    return;
  actuator_forces_->resolve(workspace_);
  outputs_.tau.row(i) = actuator_forces_->tau().transpose();
  outputs_.F_p.row(i) = joined(actuator_forces_->modal_force(), outputs_.F_p.cols()).transpose();
}

Outputs OutputEvaluator::take(std::size_t reached) {
  const auto T = static_cast<Index>(reached);
  for (auto *x : {&outputs_.q, &outputs_.v, &outputs_.a, &outputs_.lambda, &outputs_.residual})
    x->conservativeResize(T, Eigen::NoChange);
  if (actuator_forces_)
    for (auto *x : {&outputs_.tau, &outputs_.F_p})
      x->conservativeResize(T, Eigen::NoChange);
  return std::move(outputs_);
}

namespace {

// Throws std::invalid_argument where the checkpoint is not one of this motion.
void restore(ConstrainedMotion &motion, const Checkpoint &checkpoint) {
  const Peaks &now = motion.norm().peaks(), &then = checkpoint.peaks;
  if (checkpoint.integration.state.size() != motion.local().state_size() || then.bodies.size() != now.bodies.size() ||
      then.groups.size() != now.groups.size())
    throw std::invalid_argument("checkpoint: expected one of the same system, found one of other sizes");
  motion.norm().set_peaks(then);
}

} // namespace

Run run(ConstrainedMotion &motion, const std::vector<double> &times, const Eigen::VectorXd &q, const Eigen::VectorXd &v,
        const IntegrationControls &controls, OutputEvaluator evaluate, const std::function<bool(double)> &carry_on,
        Recording *recording, Checkpoint *checkpoint) {
  Run result;
  result.last.resize(q.size() + v.size());
  result.last << q, v;
  motion.norm().plan(times.back() - times.front());
  if (checkpoint && checkpoint->integration.has_begun())
    restore(motion, *checkpoint);
  result.report = integrate(
      motion, times, result.last, controls,
      [&](std::size_t i, double t, const double *state) { evaluate(i, t, state); }, carry_on, recording, nullptr,
      checkpoint ? &checkpoint->integration : nullptr);
  if (checkpoint)
    checkpoint->peaks = motion.norm().peaks();
  result.outputs = evaluate.take(result.report.outputs);
  return result;
}

} // namespace ffrobot
