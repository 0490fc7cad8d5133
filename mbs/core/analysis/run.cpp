#include "core/analysis/run.h"

namespace ffrobot {

using Eigen::Index;

OutputEvaluator::OutputEvaluator(const System &system, std::size_t count, ExternalLoads *steering,
                                 ActuatorForces *resolver)
    : system_(system), workspace_(system), steering_(steering), resolver_(resolver), y_(2 * system.coordinates),
      a_(system.coordinates) {
  const auto T = static_cast<Index>(count), m = static_cast<Index>(system.constraints.size());
  value_ = rate_ = Eigen::VectorXd::Zero(m);
  for (auto *x : {&outputs_.q, &outputs_.v, &outputs_.a})
    x->resize(T, system.coordinates);
  outputs_.lambda.resize(T, m);
  outputs_.residual.resize(T, 3);
  if (resolver) {
    Index modes = 0;
    for (const auto &body : system.bodies)
      modes += body.modes();
    outputs_.tau.resize(T, resolver->tau().size());
    outputs_.F_p.resize(T, modes);
  }
}

void OutputEvaluator::operator()(std::size_t output, double t, const double *y) {
  const auto i = static_cast<Index>(output);
  const Index n = system_.coordinates;
  y_ = Eigen::Map<const Eigen::VectorXd>(y, 2 * n);
  double *q = y_.data(), *v = q + n;
  if (steering_)
    steering_->steer(t, workspace_);
  accelerations(system_, t, q, v, workspace_, a_.data());
  if (!system_.constraints.empty()) {
    project(system_, t, q, v, workspace_);
    constraint_residuals(system_, t, q, v, workspace_, value_.data(), rate_.data());
    outputs_.residual(i, 0) = value_.lpNorm<Eigen::Infinity>() / (1 + y_.head(n).lpNorm<Eigen::Infinity>());
    outputs_.residual(i, 1) = rate_.lpNorm<Eigen::Infinity>() / (1 + y_.tail(n).lpNorm<Eigen::Infinity>());
    accelerations(system_, t, q, v, workspace_, a_.data());
    outputs_.residual(i, 2) = acceleration_residual(system_, q, a_.data(), workspace_);
  } else
    outputs_.residual.row(i).setZero();
  outputs_.q.row(i) = y_.head(n).transpose();
  outputs_.v.row(i) = y_.tail(n).transpose();
  outputs_.a.row(i) = a_.transpose();
  outputs_.lambda.row(i) = workspace_.lambda.transpose();
  if (!resolver_)
    return;
  resolver_->resolve(workspace_);
  outputs_.tau.row(i) = resolver_->tau().transpose();
  Index column = 0;
  for (const auto &F_p : resolver_->modal_force()) {
    outputs_.F_p.row(i).segment(column, F_p.size()) = F_p.transpose();
    column += F_p.size();
  }
}

Outputs OutputEvaluator::take(std::size_t reached) {
  const auto T = static_cast<Index>(reached);
  for (auto *x : {&outputs_.q, &outputs_.v, &outputs_.a, &outputs_.lambda, &outputs_.residual})
    x->conservativeResize(T, Eigen::NoChange);
  if (resolver_)
    for (auto *x : {&outputs_.tau, &outputs_.F_p})
      x->conservativeResize(T, Eigen::NoChange);
  return std::move(outputs_);
}

Run run(ConstrainedMotion &motion, const std::vector<double> &times, const Eigen::VectorXd &q, const Eigen::VectorXd &v,
        const IntegrationControls &controls, ExternalLoads *steering, ActuatorForces *resolver,
        const std::function<bool(double)> &carry_on, Recording *recording, Checkpoint *checkpoint) {
  OutputEvaluator evaluate(motion.system(), times.size(), steering, resolver);
  Eigen::VectorXd y(2 * q.size());
  y << q, v;
  Run result;
  motion.plan(times.back() - times.front());
  result.report = integrate(
      motion, times, y, controls, [&](std::size_t i, double t, const double *state) { evaluate(i, t, state); },
      carry_on, recording, nullptr, checkpoint);
  result.outputs = evaluate.take(result.report.outputs);
  result.last = y;
  return result;
}

} // namespace ffrobot
