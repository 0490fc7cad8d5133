#include "core/recursion/motion/natural_sizes.h"

namespace ffrobot::recursion {

namespace {

double farthest(const planar::Body &b) {
  double r = b.mass > 0 ? std::sqrt(b.J / b.mass) : 0;
  for (const planar::Port &port : b.ports)
    r = std::max(r, std::hypot(port.x, port.y));
  return r;
}
double farthest(const spatial::Body &b) {
  double polar = 0;
  for (int i = 0; i < 3; ++i)
    polar += 0.5 * b.J0[symmetric_index(i, i)];
  double r = b.mass > 0 ? std::sqrt(polar / b.mass) : 0;
  for (const spatial::Port &port : b.ports)
    r = std::max(r, std::hypot(port.r[0], port.r[1], port.r[2]));
  return r;
}

template <class Numbers> double largest(const Numbers &x, const VectorXd &inverse_size) {
  return x.cwiseProduct(inverse_size).template lpNorm<Eigen::Infinity>();
}

} // namespace

template <class Space> bool is_moment(const Mechanism<Space> &m, const Constraint &row) {
  if (row.model.kind != ConstraintKind::coordinate)
    return row.model.kind != ConstraintKind::point && row.model.kind != ConstraintKind::slide;
  return m.nodes[row.node].shape.freedoms.component[row.freedom] >= Space::linear;
}

template <class Space> NaturalSizes<Space>::NaturalSizes(const Mechanism<Space> &mechanism) {
  for (const Node<Space> &node : mechanism.nodes) {
    reach_.push_back(farthest(node.body));
    length_ = std::max(length_, reach_.back());
  }
  length_ = length_ > 0 ? length_ : 1;
  by_gravity_ = std::sqrt(mechanism.gravity.norm() / length_);
  pace_ = by_gravity_ > 0 ? by_gravity_ : 1;
  of_row_ = VectorXd::Ones(mechanism.constraints.size());
  for (std::size_t r = 0; r < mechanism.constraints.size(); ++r)
    if (!is_moment(mechanism, mechanism.constraints[r]))
      of_row_[r] = length_;
  of_q_ = VectorXd::Ones(mechanism.n_q), of_v_ = VectorXd::Ones(mechanism.n_v);
  for (const Node<Space> &node : mechanism.nodes) {
    const JointShape &shape = node.shape;
    for (int k = 0; k < shape.freedoms.count; ++k)
      if (shape.freedoms.component[k] < Space::linear)
        of_v_[node.v + k] = length_;
    const int numbers = shape.quaternion < 0 ? shape.q_count() : shape.quaternion; // those of quaternions come last
    of_q_.segment(node.q, numbers) = of_v_.segment(node.v, numbers);
    const double of_modes = std::sqrt(node.body.mass) * length_;
    of_q_.segment(node.p_q(), node.n()).setConstant(of_modes);
    of_v_.segment(node.p_v(), node.n()).setConstant(of_modes);
  }
  for (VectorXd *sizes : {&of_row_, &of_q_, &of_v_})
    *sizes = sizes->cwiseInverse();
}

template <class Space> void NaturalSizes<Space>::plan(double duration) { pace_ = std::max(1 / duration, by_gravity_); }

template <class Space> double NaturalSizes<Space>::of_values(const VectorXd &value, const double *q) const {
  return largest(value, of_row_) / (1 + largest(Map<const VectorXd>(q, of_q_.size()), of_q_));
}

template <class Space> double NaturalSizes<Space>::of_rates(const VectorXd &rate, const double *v) const {
  return largest(rate, of_row_) / (pace_ + largest(Map<const VectorXd>(v, of_v_.size()), of_v_));
}

template <class Space> MatrixXd NaturalSizes<Space>::of_gradients(const MatrixXd &gradients) const {
  return of_row_.asDiagonal() * gradients * of_v_.cwiseInverse().asDiagonal();
}

template bool is_moment(const Mechanism<Planar> &, const Constraint &);
template bool is_moment(const Mechanism<Spatial> &, const Constraint &);
template class NaturalSizes<Planar>;
template class NaturalSizes<Spatial>;

} // namespace ffrobot::recursion
