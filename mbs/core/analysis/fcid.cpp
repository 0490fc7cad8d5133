#include "core/analysis/fcid.h"

#include "core/actuation/side_by_side.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace ffrobot {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

FullyConstrained::FullyConstrained(const System &system, VectorXd guess)
    : system_(system), workspace_(system), q_(std::move(guess)), gradients_(static_cast<Index>(system.bodies.size())) {
  v_ = a_ = f_ = step_ = VectorXd::Zero(system.n_v());
  value_ = rate_ = acceleration_ = VectorXd::Zero(static_cast<Index>(system.rows.size()));
  for (const auto &body : system.bodies)
    shape_force_.emplace_back(VectorXd::Zero(body.modes()));
}

void FullyConstrained::set_shape(double t, const std::vector<ModalShape> &shape) {
  for (std::size_t b = 0; b < shape.size(); ++b)
    for (std::size_t k = 0; k < shape[b].size(); ++k) {
      const Index i = system_.first_coordinate[b] + 3 + static_cast<Index>(k);
      const Jet p = shape[b][k](t);
      q_[i] = p.value;
      v_[i] = p.rate;
      a_[i] = p.acceleration;
    }
}

void FullyConstrained::set_shape(const VectorXd &p) {
  const VectorXd rest = VectorXd::Zero(p.size());
  set_shape(p, rest, rest);
}

void FullyConstrained::set_shape(const VectorXd &p, const VectorXd &p_dot, const VectorXd &p_ddot) {
  Index column = 0;
  for (std::size_t b = 0; b < system_.bodies.size(); ++b) {
    const Index i = system_.first_coordinate[b] + 3, n = system_.bodies[b].modes();
    q_.segment(i, n) = p.segment(column, n);
    v_.segment(i, n) = p_dot.segment(column, n);
    a_.segment(i, n) = p_ddot.segment(column, n);
    column += n;
  }
}

void FullyConstrained::start_at(const VectorXd &q) {
  for (const Index i : system_.first_coordinate)
    q_.segment<3>(i) = q.segment<3>(i);
  started_ = false;
}

void FullyConstrained::set_target(double t, std::size_t constraint, const Jet &target) {
  workspace_.targets[constraint] = target;
  workspace_.target_time = t;
}

void FullyConstrained::update_jacobian() {
  for (std::size_t r = 0; r < system_.rows.size(); ++r) {
    const Measure &row = system_.rows[r];
    evaluate(row, workspace_.bodies, workspace_.rows[r]);
    if (r < system_.n_bilateral())
      gradients_.set_column(static_cast<Index>(r), row, workspace_.rows[r], workspace_.bodies);
  }
  gradients_.factorise();
}

// C_q,r^-1 rhs on the frames' coordinates (R, theta), zero on p
const VectorXd &FullyConstrained::frame_step(const VectorXd &rhs) {
  const VectorXd step = gradients_.solve_transposed(rhs.head(static_cast<Index>(system_.n_bilateral())));
  step_.setZero();
  for (std::size_t b = 0; b < system_.bodies.size(); ++b)
    step_.segment<3>(system_.first_coordinate[b]) = step.segment<3>(static_cast<Index>(3 * b));
  return step_;
}

bool FullyConstrained::find_position(double t) {
  constexpr double tolerance = 1e-13, floor = 1e-11;
  constexpr int most_iterations = 30;
  double previous = 1e300;
  for (int i = 0; i < most_iterations; ++i) {
    constraint_residuals(system_, t, q_.data(), v_.data(), workspace_, value_.data(), rate_.data());
    update_jacobian();
    const double left = value_.lpNorm<Eigen::Infinity>() / (1 + q_.lpNorm<Eigen::Infinity>());
    if (left <= tolerance || (left <= floor && left > 0.2 * previous))
      return true;
    if (!std::isfinite(left))
      return false;
    previous = left;
    system_.space.integrate(q_.data(), -1, frame_step(value_).data(), q_.data());
  }
  return false;
}

// f_r += d mu with the moments mu = J d^T q_ddot of the rotors, which become their multipliers
void FullyConstrained::add_rotors(VectorXd &f_r) {
  if (system_.rotors.empty())
    return;
  constraint_accelerations(system_, q_.data(), a_.data(), workspace_, acceleration_.data());
  for (std::size_t k = 0; k < system_.rotors.size(); ++k) {
    const Rotor &rotor = system_.rotors[k];
    const std::size_t r = system_.n_bilateral() + k;
    const auto i = static_cast<Index>(r);
    const double mu = workspace_.lambda[i] = acceleration_[i] / rotor.compliance;
    VectorXd d = VectorXd::Zero(f_r.size());
    add_frame_gradient(rotor.row, workspace_.rows[r], workspace_.bodies, d);
    f_r += mu * d;
  }
}

bool FullyConstrained::solve(double t) {
  if (!move(t))
    return false;
  balance(t);
  return workspace_.lambda.allFinite();
}

bool FullyConstrained::move(double t) {
  if (started_) { // on with the velocity of the frames; p is given
    step_.setZero();
    for (const Index i : system_.first_coordinate)
      step_.segment<3>(i) = v_.segment<3>(i);
    system_.space.integrate(q_.data(), t - time_, step_.data(), q_.data());
  }
  started_ = true;
  time_ = t;
  if (!find_position(t))
    return false;
  v_ -= frame_step(rate_); // C_q v + C_t is linear in v: exact in one step
  constraint_residuals(system_, t, q_.data(), v_.data(), workspace_, value_.data(), rate_.data());
  for (std::size_t r = 0; r < system_.rows.size(); ++r) // biases of slides go with v
    evaluate(system_.rows[r], workspace_.bodies, workspace_.rows[r]);
  constraint_accelerations(system_, q_.data(), a_.data(), workspace_, acceleration_.data());
  a_ -= frame_step(acceleration_);
  return a_.allFinite();
}

void FullyConstrained::balance(double t) {
  required_force(system_, t, q_.data(), v_.data(), a_.data(), workspace_, f_.data());
  VectorXd f_r(static_cast<Index>(3 * system_.bodies.size()));
  for (std::size_t b = 0; b < system_.bodies.size(); ++b)
    f_r.segment<3>(static_cast<Index>(3 * b)) = f_.segment<3>(system_.first_coordinate[b]);
  add_rotors(f_r);
  workspace_.lambda.head(f_r.size()) = -gradients_.solve(f_r);
  for (auto &wrench : workspace_.wrench)
    wrench.setZero();
  for (std::size_t r = 0; r < system_.rows.size(); ++r)
    add_wrench(system_.rows[r], workspace_.rows[r], workspace_.lambda[static_cast<Index>(r)], workspace_.wrench);
  for (std::size_t b = 0; b < system_.bodies.size(); ++b) {
    shape_force_[b] = f_.segment(system_.first_coordinate[b] + 3, system_.bodies[b].modes());
    add_modal_force(system_.bodies[b], workspace_.bodies[b], workspace_.wrench[b], shape_force_[b]);
  }
}

namespace {

VectorXd modal_stiffness(const System &system) {
  std::vector<VectorXd> stiffness;
  for (const auto &body : system.bodies)
    stiffness.push_back(body.stiffness);
  return joined(stiffness, system.n_modes());
}

} // namespace

FcidOutputs collect(const FullyConstrained &motion, const std::vector<double> &times,
                    const std::function<bool(double)> &solve, ActuatorForces *actuator_forces) {
  const System &system = motion.system();
  const auto T = static_cast<Index>(times.size()), m = static_cast<Index>(system.rows.size());
  const Index n = system.n_modes();
  FcidOutputs out;
  out.q.resize(T, system.n_q());
  for (auto *x : {&out.v, &out.a})
    x->resize(T, system.n_v());
  out.lambda.resize(T, m);
  out.shape_force.resize(T, n);
  out.residual.resize(T, 3);
  if (actuator_forces) {
    out.tau.resize(T, actuator_forces->tau().size());
    out.F_p.resize(T, n);
  }
  for (Index i = 0; i < T; ++i) {
    if (!solve(times[static_cast<std::size_t>(i)])) {
      out.completed = false;
      return out;
    }
    ++out.reached;
    out.q.row(i) = motion.q().transpose();
    out.v.row(i) = motion.v().transpose();
    out.a.row(i) = motion.a().transpose();
    out.lambda.row(i) = motion.workspace().lambda.transpose();
    out.shape_force.row(i) = joined(motion.shape_force(), n).transpose();
    out.residual(i, 0) =
        motion.position_residual().lpNorm<Eigen::Infinity>() / (1 + motion.q().lpNorm<Eigen::Infinity>());
    out.residual(i, 1) =
        motion.velocity_residual().lpNorm<Eigen::Infinity>() / (1 + motion.v().lpNorm<Eigen::Infinity>());
    out.residual(i, 2) = acceleration_residual(system, motion.q().data(), motion.a().data(), motion.workspace());
    if (!actuator_forces)
      continue;
    actuator_forces->resolve(motion.workspace());
    out.tau.row(i) = actuator_forces->tau().transpose();
    out.F_p.row(i) = joined(actuator_forces->modal_force(), n).transpose() + out.shape_force.row(i);
  }
  return out;
}

FcidOutputs fully_constrained(const System &system, const std::vector<double> &times,
                              const std::vector<ModalShape> &shape, const VectorXd &guess,
                              ActuatorForces *actuator_forces) {
  FullyConstrained motion(system, guess);
  const auto solve = [&](double t) {
    motion.set_shape(t, shape);
    return motion.solve(t);
  };
  return collect(motion, times, solve, actuator_forces);
}

MatrixXd static_shape(const System &system, const std::vector<double> &times, const VectorXd &guess,
                      ActuatorForces *actuator_forces) {
  constexpr int most_iterations = 100;
  constexpr double tolerance = 1e-14; // of the shape's size
  const Index n = system.n_modes();
  const VectorXd K = modal_stiffness(system);
  MatrixXd shapes(static_cast<Index>(times.size()), n);
  const auto shape = [&](std::size_t i) { return shapes.row(static_cast<Index>(i)).transpose(); };
  FullyConstrained motion(system, guess);
  VectorXd p = VectorXd::Zero(n);
  double rate = 1; // by which a step shrinks from iteration to iteration, as seen last
  for (std::size_t i = 0; i < times.size(); ++i) {
    const auto row = static_cast<Index>(i);
    if (i >= 4) // the cubic through the last four, which lie equally far apart
      p = 4 * (shape(i - 1) + shape(i - 3)) - 6 * shape(i - 2) - shape(i - 4);
    double previous = 0;
    bool found = false;
    for (int k = 0; k < most_iterations && !found; ++k) {
      motion.set_shape(p);
      if (!motion.solve(times[i]))
        break;
      VectorXd F_p = joined(motion.shape_force(), n);
      if (actuator_forces) {
        actuator_forces->resolve(motion.workspace());
        F_p += joined(actuator_forces->modal_force(), n);
      }
      const VectorXd step = F_p.cwiseQuotient(K);
      p -= step;
      const double size = step.norm() / (p.norm() + std::numeric_limits<double>::min());
      if (previous > 0 && size > 10 * tolerance)
        rate = size / previous;
      found = size * std::min(rate, 1.0) <= tolerance;
      previous = size;
    }
    if (!found)
      return shapes.topRows(row);
    shapes.row(row) = p.transpose();
  }
  return shapes;
}

} // namespace ffrobot
