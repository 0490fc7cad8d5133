#include "core/recursion/motion/newton_system.h"

namespace ffrobot::recursion {

using Eigen::Index;
using Eigen::VectorXd;

template <class Space>
NewtonSystem<Space>::NewtonSystem(const Mechanism<Space> &mechanism, const Scene &scene)
    : mechanism_(mechanism), scene_(scene), w_(mechanism), posture_(mechanism), q_(VectorXd::Zero(mechanism.n_q)),
      v_(VectorXd::Zero(mechanism.n_v)) {
  find_stiff_terms();
}

// Of elastic and damping forces of modes, of springs in joints
template <class Space> void NewtonSystem<Space>::find_stiff_terms() {
  const auto cuts = static_cast<Index>(scene_.cut_joints.size());
  stiffness_ = damping_ = VectorXd::Zero(v_.size() + cuts);
  coupling_.setZero(v_.size(), cuts);
  for (const Node<Space> &node : mechanism_.nodes)
    for (int i = 0; i < node.n(); ++i) {
      stiffness_[node.p_v() + i] = node.body.K[i];
      damping_[node.p_v() + i] = node.body.D_full.size() ? node.body.D_full(i, i) : node.body.D[i];
    }
  for (const JointForce &joint : scene_.joint_forces)
    stiffness_[joint.v] += joint.stiffness;
  take_friction(VectorXd::Zero(stiffness_.size())); // at rest, where none that acts has a slope of zero
  std::size_t node = 0;
  for (const Node<Space> &joint : mechanism_.nodes)
    if (posture_.body(node++).turn.size() > 0 && (stiffness_[joint.v] != 0 || damping_[joint.v] != 0))
      turned_.push_back(joint.v);
}

// Of friction in joints, at rates (n_v, then cut joints). Near rest dry friction is a stiff damper: a light link's end
// that sticks to what it carries comes to rest within nanoseconds.
template <class Space> void NewtonSystem<Space>::take_friction(const VectorXd &rates) {
  for (const JointForce &joint : scene_.joint_forces)
    damping_[joint.v] = 0;
  for (const JointForce &joint : scene_.joint_forces)
    damping_[joint.v] += joint.friction.slope(rates[joint.v]);
  for (std::size_t k = 0; k < scene_.cut_joints.size(); ++k) {
    const Index i = v_.size() + static_cast<Index>(k);
    damping_[i] = scene_.cut_joints[k].friction.slope(rates[i]);
  }
}

template <class Space> void NewtonSystem<Space>::set_state(const double *q, const double *v) {
  std::copy_n(q, q_.size(), q_.data());
  std::copy_n(v, v_.size(), v_.data());
  posture_is_old_ = true;
}

template <class Space> void NewtonSystem<Space>::find_coupling() {
  VectorXd unit = VectorXd::Zero(v_.size()), rates(coupling_.cols());
  for (Index i = 0; i < v_.size(); ++i) {
    unit[i] = 1;
    cut_rates(place_all(mechanism_, q_.data(), unit.data(), nullptr, w_), scene_.cut_joints, rates.data());
    coupling_.row(i) = rates.transpose();
    unit[i] = 0;
  }
}

template <class Space> void NewtonSystem<Space>::take_posture() {
  if (!posture_is_old_)
    return;
  posture_.take(q_.data(), w_);
  if (coupling_.size() > 0)
    find_coupling();
  const auto kept = static_cast<Index>(w_.active.size()), turned = static_cast<Index>(turned_.size());
  C_.setZero(kept + coupling_.cols() + turned, v_.size());
  C_.topRows(kept) = posture_.gradients()(w_.active, Eigen::all);
  C_.middleRows(kept, coupling_.cols()) = coupling_.transpose();
  for (Index k = 0; k < turned; ++k)
    C_(kept + coupling_.cols() + k, turned_[static_cast<std::size_t>(k)]) = 1;
  posture_is_old_ = false;
}

template <class Space>
template <class Scalar>
void NewtonSystem<Space>::factorise(NewtonMatrix<Space, Scalar> &matrix, Scalar damping_factor,
                                    Scalar stiffness_factor) {
  using Vector = Eigen::Matrix<Scalar, Eigen::Dynamic, 1>;
  take_posture();
  VectorXd rates(stiffness_.size());
  rates << v_, coupling_.transpose() * v_;
  take_friction(rates);
  const Vector E = damping_factor * damping_ + stiffness_factor * stiffness_;
  Vector of_tree = E.head(v_.size()), extra(coupling_.cols() + static_cast<Index>(turned_.size()));
  extra << E.tail(coupling_.cols()), of_tree(turned_);
  of_tree(turned_).setZero();
  matrix.factorise(posture_, C_, of_tree, extra);
}

template <class Space> void NewtonSystem<Space>::factorise(double damping_factor, double stiffness_factor) {
  factorise(real_, damping_factor, stiffness_factor);
}

template <class Space> void NewtonSystem<Space>::factorise(Complex damping_factor, Complex stiffness_factor) {
  factorise(complex_, damping_factor, stiffness_factor);
}

// x = B^T r
template <class Space> template <class Scalar> void NewtonSystem<Space>::spread(const Scalar *r, Scalar *x) const {
  using Vector = Eigen::Matrix<Scalar, Eigen::Dynamic, 1>;
  Eigen::Map<Vector> x_(x, v_.size());
  x_ = Eigen::Map<const Vector>(r, v_.size());
  if (coupling_.cols() > 0)
    x_ += coupling_ * Eigen::Map<const Vector>(r + v_.size(), coupling_.cols());
}

template <class Space> void NewtonSystem<Space>::solve(const double *r, const double *c, double *x) {
  spread(r, x);
  if (!c) {
    real_.solve(nullptr, x);
    return;
  }
  const auto equations = static_cast<Index>(mechanism_.constraints.size());
  const VectorXd kept = Eigen::Map<const VectorXd>(c, equations)(w_.active);
  real_.solve(kept.data(), x);
}

template <class Space> void NewtonSystem<Space>::solve(const Complex *r, Complex *x) {
  spread(r, x);
  complex_.solve(nullptr, x);
}

template <class Space> void NewtonSystem<Space>::constrain(const double *x, double *c) {
  const Eigen::MatrixXd &C = posture_.gradients();
  Eigen::Map<VectorXd>(c, C.rows()) = C * Eigen::Map<const VectorXd>(x, v_.size());
}

template class NewtonSystem<Planar>;
template class NewtonSystem<Spatial>;

} // namespace ffrobot::recursion
