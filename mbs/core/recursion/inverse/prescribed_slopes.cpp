// How a prescribed motion and its forces answer to small changes of the modes: by dual numbers, without differences.
#include "core/linear/products.h"
#include "core/recursion/inverse/force_slopes.h"
#include "core/recursion/inverse/prescribed_motion.h"

#include <algorithm>

namespace ffrobot::recursion {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Of accelerations that the generalized forces (n_v) lead to, which are those of the motion, while the constraint
// equations `active` keep the second derivatives that they have.
template <class Space>
Derivatives PrescribedMotion<Space>::derivatives_under(const VectorXd &forces, const std::vector<int> &active) {
  VectorXd target(lambda_.size());
  for (Index r = 0; r < target.size(); ++r)
    target[r] = forces_.of_constraint(r, a_.data(), w_).value;
  w_.keep(active);
  const double t = std::clamp(time_, first_, last_);
  return recursion::derivatives_under(driven_.mechanism, driven_.scene, t, state_, forces, target, w_);
}

// With all constraint equations C_ddot stays what it is: its derivatives at given a are -C_v a_q and -C_v a_v. Rows of
// a path that is followed are coordinates, whose C_v is constant.
template <class Space> JointSlopes PrescribedMotion<Space>::joint_slopes(const JointSlopes *followed) {
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
  const auto put = [&](MatrixXd rows, MatrixXd JointSlopes::*which) {
    for (Index r = 0; followed && r < rows.rows(); ++r)
      if (driven_.is_path[r])
        rows.row(r) += C.row(r) * followed->*which;
    (to.*which)(joints, Eigen::all) = factors_.solve(rows);
  };
  put(-C(Eigen::all, driven_.of_modes), &JointSlopes::q);
  put(-matrix_product(found.rate_q, to.q), &JointSlopes::v);
  put(matrix_product(C, matrix_product(found.a_v, to.q)), &JointSlopes::a_v);
  put(matrix_product(C, matrix_product(found.a_q, to.q) + matrix_product(found.a_v, to.v)), &JointSlopes::a_p);
  return to;
}

// M a - Q + C^T lambda = f leads to f_q = -(M a_q + C^T lambda_q) at given a and multipliers: those of loops with
// motors, else of all constraint equations. Without motors the joints' motion J by p, C J = 0, has the forces left as
// J^T f.
template <class Space> LeftSlopes PrescribedMotion<Space>::left_slopes(const JointSlopes &joints) {
  VectorXd forces = VectorXd::Zero(a_.size());
  if (acting_.generalized)
    forces += Eigen::Map<const VectorXd>(acting_.generalized, a_.size());
  std::vector<int> active = motion_.workspace().active;
  if (const Motors<Space> *found = motors()) {
    forces(driven_.of_modes) += (found->left() - found->beside())(driven_.of_modes);
    for (std::size_t k = 0; k < driven_.motors.size(); ++k)
      forces[driven_.motors[k].coordinate] += driven_.motors[k].sign * found->tau()[k];
    std::erase_if(active, [&](int r) { return driven_.is_path[r]; });
  } else
    forces(driven_.of_modes) += shape_force();
  const auto shares_of = [&](const MatrixXd &of_forces) {
    if (motors_)
      return motors_->shares_of(of_forces);
    MatrixXd found = MatrixXd::Zero(modes(), modes());
    add_transposed_product(joints.q, of_forces, found);
    return found;
  };
  const Derivatives found = derivatives_under(forces, active);
  const MatrixXd M = mass_matrix(q(), forces_, w_);
  MatrixXd by_q = -matrix_product(M, found.a_q), by_v = -matrix_product(M, found.a_v);
  add_transposed_product(found.value_q, found.lambda_q, by_q, -1);
  add_transposed_product(found.value_q, found.lambda_v, by_v, -1);
  add_slopes(driven_.scene, q(), v(), by_q, by_v);
  return {shares_of(matrix_product(M, joints.q)),
          shares_of(matrix_product(by_v, joints.q) + matrix_product(M, joints.a_v)),
          shares_of(matrix_product(by_q, joints.q) + matrix_product(by_v, joints.v) + matrix_product(M, joints.a_p))};
}

template <class Space> LeftSlopes RedefinedMotion<Space>::slopes() {
  const auto &driven = this->driven();
  path_.balance();
  JointSlopes joints = path_.joint_slopes();
  for (MatrixXd *of : {&joints.q, &joints.v, &joints.a_p, &joints.a_v})
    (*of)(driven.of_joints, Eigen::all) *= factor_;
  return this->left_slopes(&driven.mechanism == &path_.driven().mechanism ? joints : this->joint_slopes(&joints));
}

template Derivatives PrescribedMotion<Planar>::derivatives_under(const VectorXd &, const std::vector<int> &);
template Derivatives PrescribedMotion<Spatial>::derivatives_under(const VectorXd &, const std::vector<int> &);
template JointSlopes PrescribedMotion<Planar>::joint_slopes(const JointSlopes *);
template JointSlopes PrescribedMotion<Spatial>::joint_slopes(const JointSlopes *);
template LeftSlopes PrescribedMotion<Planar>::left_slopes(const JointSlopes &);
template LeftSlopes PrescribedMotion<Spatial>::left_slopes(const JointSlopes &);
template LeftSlopes RedefinedMotion<Planar>::slopes();
template LeftSlopes RedefinedMotion<Spatial>::slopes();

} // namespace ffrobot::recursion
