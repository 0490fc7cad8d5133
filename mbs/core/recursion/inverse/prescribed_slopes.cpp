// How a prescribed motion and its forces answer to small changes of the modes: by dual numbers, without differences.
#include "core/linear/products.h"
#include "core/recursion/constrained_aba/derivatives.h"
#include "core/recursion/inverse/prescribed_motion.h"

#include <algorithm>
#include <stdexcept>

namespace ffrobot::recursion {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

// Of what the scene does along joints, by increments of q and by v
void add_slopes(const Scene &scene, const double *q, const double *v, MatrixXd &by_q, MatrixXd &by_v) {
  for (const JointForce &joint : scene.joint_forces) {
    by_q(joint.v, joint.v) += joint.stiffness;
    by_v(joint.v, joint.v) += joint.friction.slope(v[joint.v]);
  }
  for (const auto &[a, b, ratio, spring, damping] : scene.gears) {
    const double stiffness = spring.slope(q[a.q] - ratio * q[b.q]);
    for (const auto &[i, of_i] : {std::pair{a.v, 1.}, std::pair{b.v, -ratio}})
      for (const auto &[j, of_j] : {std::pair{a.v, 1.}, std::pair{b.v, -ratio}})
        by_q(i, j) += of_i * of_j * stiffness, by_v(i, j) += of_i * of_j * damping;
  }
}

} // namespace

// Of accelerations that the generalized forces (n_v) lead to, which are those of the motion, while the constraint
// equations `active` keep the second derivatives that they have.
template <class Space>
Derivatives PrescribedMotion<Space>::derivatives_under(const VectorXd &forces, const std::vector<int> &active) {
  const Mechanism<Space> &m = driven_.mechanism;
  const Scene &scene = driven_.scene;
  const double t = std::clamp(time_, first_, last_);
  VectorXd wrench = VectorXd::Zero(Space::dim * static_cast<Index>(m.wrenches.size()));
  VectorXd along_cuts = VectorXd::Zero(static_cast<Index>(scene.cut_joints.size())), target(lambda_.size());
  for (const PointLoad &load : scene.point_loads)
    wrench[Space::dim * load.wrench + load.component] += load.share * load.magnitude(t).value;
  for (const CutLoad &load : scene.cut_loads)
    along_cuts[load.joint] += load.share * load.magnitude(t).value;
  for (std::size_t r = 0; r < m.constraints.size(); ++r)
    target[static_cast<Index>(r)] = forces_.of_constraint(r, a_.data(), w_).value;
  w_.keep(active);
  return derivatives(m, w_, q(), v(), Forces<double>{forces.data(), wrench.data()},
                     {scene.cut_joints, along_cuts.data(), scene.point_forces, t, NaturalSizes<Space>(m).length()},
                     target.data());
}

// With all constraint equations C_ddot stays what it is: its derivatives at given a are -C_v a_q and -C_v a_v.
template <class Space> JointSlopes PrescribedMotion<Space>::joint_slopes() {
  VectorXd forces = VectorXd::Zero(a_.size());
  if (acting_.generalized)
    forces += Eigen::Map<const VectorXd>(acting_.generalized, a_.size());
  forces(driven_.of_modes) += shape_force();
  const Derivatives found = derivatives_under(forces, motion_.workspace().active);
  const MatrixXd &C = found.value_q;
  const auto &joints = driven_.of_joints;
  JointSlopes to;
  to.q = to.v = to.a_p = to.a_v = MatrixXd::Zero(a_.size(), modes());
  to.q(driven_.of_modes, Eigen::all).setIdentity();
  const auto put = [&](const MatrixXd &rows, MatrixXd &all) { all(joints, Eigen::all) = factors_.solve(rows); };
  put(-C(Eigen::all, driven_.of_modes), to.q);
  put(-matrix_product(found.rate_q, to.q), to.v);
  put(matrix_product(C, matrix_product(found.a_v, to.q)), to.a_v);
  put(matrix_product(C, matrix_product(found.a_q, to.q) + matrix_product(found.a_v, to.v)), to.a_p);
  return to;
}

// M a - Q + C_c^T lambda_c = f with the loops' multipliers leads to f_q = -(M a_q + C_c^T lambda_q) at given a.
template <class Space> LeftSlopes PrescribedMotion<Space>::left_slopes(const JointSlopes &joints) {
  if (!motors_ || std::ranges::any_of(driven_.motors, &Motor::turns_frames))
    throw std::invalid_argument("derivatives: expected motors along joint coordinates");
  motors_->split(q(), required_, w_);
  VectorXd forces = VectorXd::Zero(a_.size()), unit = forces, f = forces;
  if (acting_.generalized)
    forces += Eigen::Map<const VectorXd>(acting_.generalized, a_.size());
  forces(driven_.of_modes) += motors_->left()(driven_.of_modes);
  for (std::size_t k = 0; k < driven_.motors.size(); ++k)
    forces[driven_.motors[k].coordinate] += driven_.motors[k].sign * motors_->tau()[static_cast<Index>(k)];
  std::vector<int> loops = motion_.workspace().active;
  std::erase_if(loops, [&](int r) { return driven_.is_path[static_cast<std::size_t>(r)]; });
  const Derivatives found = derivatives_under(forces, loops);
  MatrixXd M(a_.size(), a_.size());
  forces_.load(nullptr, nullptr, w_);
  forces_.accelerate(q(), unit.data(), w_);
  forces_.require(q(), unit.data(), w_, f.data());
  for (Index j = 0; j < unit.size(); ++j) {
    unit[j] = 1;
    forces_.accelerate(q(), unit.data(), w_);
    forces_.require(q(), unit.data(), w_, M.col(j).data());
    M.col(j) -= f;
    unit[j] = 0;
  }
  MatrixXd by_q = -matrix_product(M, found.a_q), by_v = -matrix_product(M, found.a_v);
  add_transposed_product(found.value_q, found.lambda_q, by_q, -1);
  add_transposed_product(found.value_q, found.lambda_v, by_v, -1);
  add_slopes(driven_.scene, q(), v(), by_q, by_v);
  return {motors_->shares_of(matrix_product(M, joints.q)),
          motors_->shares_of(matrix_product(by_v, joints.q) + matrix_product(M, joints.a_v)),
          motors_->shares_of(matrix_product(by_q, joints.q) + matrix_product(by_v, joints.v) +
                             matrix_product(M, joints.a_p))};
}

template <class Space> LeftSlopes RedefinedMotion<Space>::slopes() {
  const auto &driven = this->driven();
  if (&driven.mechanism != &path_.driven().mechanism)
    throw std::invalid_argument("derivatives: expected motors in all joints of a redefined output");
  path_.balance();
  JointSlopes joints = path_.joint_slopes();
  for (MatrixXd *of : {&joints.q, &joints.v, &joints.a_p, &joints.a_v})
    (*of)(driven.of_joints, Eigen::all) *= factor_;
  return this->left_slopes(joints);
}

template Derivatives PrescribedMotion<Planar>::derivatives_under(const VectorXd &, const std::vector<int> &);
template Derivatives PrescribedMotion<Spatial>::derivatives_under(const VectorXd &, const std::vector<int> &);
template JointSlopes PrescribedMotion<Planar>::joint_slopes();
template JointSlopes PrescribedMotion<Spatial>::joint_slopes();
template LeftSlopes PrescribedMotion<Planar>::left_slopes(const JointSlopes &);
template LeftSlopes PrescribedMotion<Spatial>::left_slopes(const JointSlopes &);
template LeftSlopes RedefinedMotion<Planar>::slopes();
template LeftSlopes RedefinedMotion<Spatial>::slopes();

} // namespace ffrobot::recursion
