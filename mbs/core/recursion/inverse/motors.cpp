#include "core/recursion/inverse/motors.h"

#include "core/check_index.h"
#include "core/linear/dense.h"

namespace ffrobot::recursion {

template <class Space>
DrivenMechanism<Space>::DrivenMechanism(const Mechanism<Space> &m, const Scene &s,
                                        std::vector<Motor> of_joints_and_cuts, std::vector<char> of_path)
    : mechanism(m), scene(s), motors(std::move(of_joints_and_cuts)), is_path(std::move(of_path)) {
  for (const auto &node : m.nodes) {
    for (int k = 0; k < node.shape.freedoms.count; ++k)
      of_joints.push_back(node.v + k);
    for (int k = 0; k < node.n(); ++k)
      of_modes.push_back(static_cast<int>(node.p_v()) + k);
  }
}

template <class Space> void DrivenMechanism<Space>::check() const {
  check_size("is_path", is_path.size(), mechanism.constraints.size());
  for (const Motor &motor : motors)
    check_index("coordinate of a motor", motor.coordinate, mechanism.n_v);
}

template <class Space>
Motors<Space>::Motors(DrivenMechanism<Space> driven)
    : driven_(std::move(driven)), forces_(driven_.mechanism),
      lambda_(VectorXd::Zero(driven_.mechanism.constraints.size())), tau_(VectorXd::Zero(driven_.motors.size())),
      Q_(VectorXd::Zero(driven_.mechanism.n_v)), beside_(Q_) {
  for (std::size_t r = 0; r < driven_.is_path.size(); ++r)
    if (!driven_.is_path[r])
      cuts_.push_back(static_cast<int>(r));
  lambda_c_ = VectorXd::Zero(cuts_.size());
  columns_.resize(driven_.mechanism.n_v, lambda_c_.size() + tau_.size());
}

template <class Space> std::vector<bool> Motors<Space>::are_moments() const {
  std::vector<bool> found;
  for (const Motor &motor : driven_.motors)
    for (const auto &node : driven_.mechanism.nodes)
      if (const int k = motor.coordinate - node.v; k >= 0 && k < node.shape.freedoms.count)
        found.push_back(node.shape.freedoms.component[k] >= Space::linear);
  return found;
}

template <class Space> const VectorXd &Motors<Space>::find(const double *q, const TreeWorkspace &w) {
  resolve(q, w.lambda.data(), w);
  return tau_;
}

template <class Space> void Motors<Space>::project(const double *q, const TreeWorkspace &w, Ref<VectorXd> Q) {
  forces_.load(lambda_.data(), nullptr, w);
  forces_.project(q, w, Q.data());
}

template <class Space> void Motors<Space>::take_path(const double *lambda) {
  lambda_ = Map<const VectorXd>(lambda, lambda_.size());
  for (const int row : cuts_)
    lambda_[row] = 0;
}

template <class Space>
const VectorXd &Motors<Space>::path_forces(const double *q, const double *lambda, const TreeWorkspace &w) {
  take_path(lambda);
  project(q, w, Q_);
  return Q_;
}

template <class Space>
std::vector<VectorXd> Motors<Space>::path_forces_on_bodies(const double *lambda, const TreeWorkspace &w) {
  take_path(lambda);
  forces_.load(lambda_.data(), nullptr, w);
  std::vector<VectorXd> found;
  for (std::size_t i = 0; i < driven_.mechanism.nodes.size(); ++i)
    found.push_back(forces_.on_body(i, w));
  return found;
}

template <class Space> void Motors<Space>::resolve(const double *q, const double *lambda, const TreeWorkspace &w) {
  path_forces(q, lambda, w);
  split(q, w);
}

template <class Space> void Motors<Space>::split(const double *q, const VectorXd &Q, const TreeWorkspace &w) {
  Q_ = Q;
  split(q, w);
}

template <class Space> void Motors<Space>::split(const double *q, const TreeWorkspace &w) {
  if (!cuts_.empty())
    close_loops(q, w);
  beside_.setZero();
  for (std::size_t k = 0; k < driven_.motors.size(); ++k) {
    const Motor &motor = driven_.motors[k];
    double &tau = tau_[k];
    if (cuts_.empty())
      tau = motor.sign * Q_[motor.coordinate], Q_[motor.coordinate] = 0;
    // Of a moment between the frames of bodies in place of their sections: what it does less on modes, F_p does more.
    for (std::size_t i = 0; motor.turns_frames && i < driven_.mechanism.nodes.size(); ++i)
      if (const auto &node = driven_.mechanism.nodes[i]; motor.coordinate >= node.v && motor.coordinate < node.p_v())
        forces_.add_joint_moment_on_modes(i, motor.sign * tau, w, beside_.data());
  }
  Q_ += beside_;
}

template <class Space> MatrixXd Motors<Space>::shares_of(const MatrixXd &dQ) const {
  const Index modes = driven_.of_modes.size();
  MatrixXd found(modes + tau_.size(), dQ.cols());
  found.topRows(modes) = dQ(driven_.of_modes, Eigen::all);
  if (!cuts_.empty()) {
    const MatrixXd solved = factors_.solve(dQ(driven_.of_joints, Eigen::all).eval());
    found.topRows(modes) -= matrix_product(columns_(driven_.of_modes, Eigen::all), solved);
    found.bottomRows(tau_.size()) = solved.bottomRows(tau_.size());
  } else
    for (Index k = 0; k < tau_.size(); ++k) {
      const Motor &motor = driven_.motors[k];
      found.row(modes + k) = motor.sign * dQ.row(motor.coordinate);
    }
  return found;
}

// Takes off Q what cuts and motors do, so that nothing is left of it along joint coordinates where motors suffice.
template <class Space> void Motors<Space>::close_loops(const double *q, const TreeWorkspace &w) {
  const Index cuts = lambda_c_.size();
  for (Index k = 0; k < cuts; ++k) {
    lambda_.setZero();
    lambda_[cuts_[k]] = 1;
    project(q, w, columns_.col(k));
  }
  columns_.rightCols(tau_.size()).setZero();
  for (Index k = 0; k < tau_.size(); ++k) {
    const Motor &motor = driven_.motors[k];
    columns_(motor.coordinate, cuts + k) = motor.sign;
  }
  factors_.compute(columns_(driven_.of_joints, Eigen::all));
  const VectorXd found = factors_.solve(VectorXd(Q_(driven_.of_joints)));
  lambda_c_ = found.head(cuts), tau_ = found.tail(tau_.size());
  Q_ -= columns_ * found;
}

template struct DrivenMechanism<Planar>;
template struct DrivenMechanism<Spatial>;
template class Motors<Planar>;
template class Motors<Spatial>;

} // namespace ffrobot::recursion
