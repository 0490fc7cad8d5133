#include "core/analysis/prescribed_motion.h"

#include <cmath>
#include <stdexcept>
#include <string>

namespace ffrobot {

using Eigen::Index;
using Eigen::VectorXd;

ModalMotion modes_at(const std::vector<ModalShape> &shape, double t) {
  Index n = 0, k = 0;
  for (const ModalShape &of_body : shape)
    n += static_cast<Index>(of_body.size());
  ModalMotion modes{VectorXd(n), VectorXd(n), VectorXd(n)};
  for (const ModalShape &of_body : shape)
    for (const TimeFunction &function : of_body) {
      const Jet jet = function(t);
      modes.p[k] = jet.value, modes.p_dot[k] = jet.rate, modes.p_ddot[k++] = jet.acceleration;
    }
  return modes;
}

PrescribedMotion::PrescribedMotion(const SystemOnTree &both, const VectorXd &q)
    : both_(both), w_(both.tree), forces_(both.tree), state_(VectorXd::Zero(both.state_size())),
      a_(VectorXd::Zero(both.tree.n_v)), f_(a_), Q_(a_) {
  const auto rows = static_cast<Index>(both.tree.rows.size());
  for (const auto &node : both.tree.nodes)
    for (int k = 0; k < node.shape.v_count; ++k)
      joints_.push_back(node.v + k);
  if (rows != static_cast<Index>(joints_.size()))
    throw std::invalid_argument("rows: expected " + std::to_string(joints_.size()) +
                                ", as many as joints have coordinates, got " + std::to_string(rows));
  if (q.size() != both.tree.n_q)
    throw std::invalid_argument("q: expected " + std::to_string(both.tree.n_q) + " coordinates, got " +
                                std::to_string(q.size()));
  lambda_ = value_ = rate_ = unit_ = VectorXd::Zero(rows);
  C_J_.resize(rows, rows);
  targets_.resize(both.tree.rows.size());
  state_.head(both.tree.n_q) = q;
  if (!both.reactions.motors.empty())
    motors_.emplace(both);
  motion_ = std::make_unique<TreeMotion>(both.tree, both.scene, 0.0, state_.data(), state_.data() + both.tree.n_q);
}

void PrescribedMotion::start_at(const VectorXd &q) {
  for (const int i : joints_)
    state_[i] = q[i];
  goes_on_ = false;
}

void PrescribedMotion::set_modes(const ModalMotion &modes) {
  Index column = 0;
  for (std::size_t b = 0; b < both_.system.bodies.size(); ++b) {
    const Index first = both_.drives.modes[b], n = both_.system.bodies[b].modes();
    state_.segment(first, n) = modes.p.segment(column, n);
    state_.segment(both_.tree.n_q + first, n) = modes.p_dot.segment(column, n);
    a_.segment(first, n) = modes.p_ddot.segment(column, n);
    column += n;
  }
}

void PrescribedMotion::measure() {
  recursion::measure(both_.tree, q(), q() + both_.tree.n_q, w_, value_.data(), rate_.data());
  for (std::size_t r = 0; r < targets_.size(); ++r) {
    value_[static_cast<Index>(r)] -= targets_[r].value;
    rate_[static_cast<Index>(r)] -= targets_[r].rate;
  }
}

// C_J, row by row from the generalized forces of its unit multiplier, at the state that was measured.
void PrescribedMotion::factorise() {
  const Index rows = lambda_.size();
  for (Index r = 0; r < rows; ++r) {
    unit_[r] = -1;
    forces_.load(unit_.data(), nullptr, w_);
    forces_.project_on_joints(q(), w_, Q_.data());
    for (Index k = 0; k < rows; ++k)
      C_J_(r, k) = Q_[joints_[static_cast<std::size_t>(k)]];
    unit_[r] = 0;
  }
  factors_.compute(C_J_);
}

void PrescribedMotion::put_on_joints(const VectorXd &values, double *to) const {
  for (std::size_t k = 0; k < joints_.size(); ++k)
    to[joints_[k]] += values[static_cast<Index>(k)];
}

bool PrescribedMotion::find_position() {
  constexpr double tolerance = 1e-15, floor = 1e-11; // second derivatives of splines through shapes are taken
  constexpr int most_iterations = 30;
  double previous = 1e300;
  for (int i = 0; i < most_iterations; ++i) {
    measure();
    factorise();
    const double left = value_.lpNorm<Eigen::Infinity>() / (1 + state_.head(both_.tree.n_q).lpNorm<Eigen::Infinity>());
    if (left <= tolerance || (left <= floor && left > 0.2 * previous))
      return true;
    if (!std::isfinite(left))
      return false;
    previous = left;
    put_on_joints(-factors_.solve(value_), state_.data());
  }
  return false;
}

bool PrescribedMotion::move(double t, const ModalMotion &modes) {
  return follow(t, modes, recursion::targets_at(both_.scene, t));
}

bool PrescribedMotion::follow(double t, const ModalMotion &modes, std::vector<Jet> targets) {
  targets_ = std::move(targets);
  double *q = state_.data(), *v = q + both_.tree.n_q;
  for (const int i : joints_) {
    if (goes_on_)
      q[i] += (t - time_) * v[i];
    v[i] = a_[i] = 0;
  }
  set_modes(modes);
  goes_on_ = true;
  time_ = t;
  if (!find_position())
    return false;
  put_on_joints(-factors_.solve(rate_), v); // linear in v: exact in one step
  measure();
  acting_ = motion_->act(t, q, v);
  forces_.prepare(q, v, acting_.generalized, w_);
  forces_.accelerate(q, a_.data(), w_);
  VectorXd bias(lambda_.size());
  for (std::size_t r = 0; r < targets_.size(); ++r)
    bias[static_cast<Index>(r)] = forces_.of_row(r, a_.data(), w_).value - targets_[r].acceleration;
  put_on_joints(-factors_.solve(bias), a_.data());
  return a_.allFinite();
}

std::vector<Jet> PrescribedMotion::measured_in(const PrescribedMotion &other) {
  const double *q = other.q(), *v = q + both_.tree.n_q;
  recursion::measure(both_.tree, q, v, w_, value_.data(), rate_.data());
  forces_.prepare(q, v, nullptr, w_);
  forces_.accelerate(q, other.a_.data(), w_);
  std::vector<Jet> found;
  for (std::size_t r = 0; r < targets_.size(); ++r) {
    const auto i = static_cast<Index>(r);
    found.push_back({value_[i], rate_[i], forces_.of_row(r, other.a_.data(), w_).value});
  }
  return found;
}

void PrescribedMotion::balance() {
  forces_.accelerate(q(), a_.data(), w_);
  forces_.leave_frames(w_);
  forces_.load(nullptr, acting_.wrench, w_);
  forces_.require(q(), a_.data(), w_, f_.data());
  for (const int i : joints_)
    f_[i] -= acting_.generalized ? acting_.generalized[i] : 0;
  const VectorXd of_others = -f_(joints_);
  lambda_ = factors_.transpose().solve(of_others);
  forces_.load(lambda_.data(), nullptr, w_);
  forces_.project(q(), w_, Q_.data()); // -C_v^T lambda
  f_ -= Q_;
  std::copy_n(lambda_.data(), lambda_.size(), w_.lambda.data());
}

VectorXd PrescribedMotion::left() {
  VectorXd found = shape_force();
  if (!motors_)
    return found;
  motors_->resolve(q(), lambda_.data(), w_);
  Index column = 0;
  for (std::size_t b = 0; b < both_.system.bodies.size(); ++b) {
    const VectorXd &F_p = motors_->modal_force()[b];
    found.segment(column, F_p.size()) += F_p;
    column += F_p.size();
  }
  return found;
}

RedefinedMotion::RedefinedMotion(const SystemOnTree &driven, const SystemOnTree &path, const VectorXd &q, double factor,
                                 std::vector<TimeFunction> offset)
    : PrescribedMotion(driven, q), path_(path, q), factor_(factor), offset_(std::move(offset)) {
  const auto count = static_cast<Index>(offset_.size());
  if (count != 0 && count != driven.system.n_modes())
    throw std::invalid_argument("offset: expected " + std::to_string(driven.system.n_modes()) +
                                " functions, one for each mode, or none, got " + std::to_string(count));
}

bool RedefinedMotion::move(double t, const ModalMotion &modes) {
  ModalMotion seen{factor_ * modes.p, factor_ * modes.p_dot, factor_ * modes.p_ddot};
  if (!offset_.empty()) {
    const ModalMotion more = modes_at({offset_}, t);
    seen.p += more.p, seen.p_dot += more.p_dot, seen.p_ddot += more.p_ddot;
  }
  if (!path_.move(t, seen))
    return false;
  std::vector<Jet> targets = recursion::targets_at(both().scene, t), motors = measured_in(path_);
  for (const auto &row : both().reactions.rows)
    if (row.is_trajectory)
      targets[static_cast<std::size_t>(row.row)] = motors[static_cast<std::size_t>(row.row)];
  PrescribedMotion::start_at(path_.state().head(both().tree.n_q));
  return follow(t, modes, std::move(targets));
}

VectorXd PrescribedMotion::shape_force() const {
  VectorXd found(both_.system.n_modes());
  Index column = 0;
  for (std::size_t b = 0; b < both_.system.bodies.size(); ++b) {
    const Index n = both_.system.bodies[b].modes();
    found.segment(column, n) = f_.segment(both_.drives.modes[b], n);
    column += n;
  }
  return found;
}

} // namespace ffrobot
