#include "core/recursion/newton_tree.h"

#include <complex>

namespace ffrobot::recursion {

using Eigen::Index;

namespace {

// Products of real rows with numbers that may be complex are written for the parts of these: compilers take detours
// through memory otherwise.
template <class Scalar> constexpr int parts = static_cast<int>(sizeof(Scalar) / sizeof(double));
template <class Scalar> const double *parts_of(const Scalar *x) { return reinterpret_cast<const double *>(x); }

// Sum of x_i times columns i of `rows`, their part k
template <int d, class Scalar>
Eigen::Matrix<Scalar, d, 1> combined(const Eigen::MatrixXd &rows, const Eigen::Matrix<Scalar, Eigen::Dynamic, 1> &x,
                                     int k) {
  constexpr int size = parts<Scalar>;
  double sum[size * d] = {};
  const double *x_ = parts_of(x.data());
  for (Index i = 0; i < x.size(); ++i) {
    const double *column = &rows(d * k, i);
    for (int c = 0; c < d; ++c)
      for (int part = 0; part < size; ++part)
        sum[size * c + part] += x_[size * i + part] * column[c];
  }
  return Eigen::Map<const Eigen::Matrix<Scalar, d, 1>>(reinterpret_cast<const Scalar *>(sum));
}

// f times column i of `rows`, as far as f goes
template <class Scalar>
Scalar times_column(const Eigen::MatrixXd &rows, Index i, const Eigen::Matrix<Scalar, Eigen::Dynamic, 1> &f) {
  constexpr int size = parts<Scalar>;
  double sum[size] = {};
  const double *column = &rows(0, i), *f_ = parts_of(f.data());
  for (Index c = 0; c < f.size(); ++c)
    for (int part = 0; part < size; ++part)
      sum[part] += column[c] * f_[size * c + part];
  return *reinterpret_cast<const Scalar *>(sum);
}

// Sum of w_i a b^T over modes: a, b parts of columns i of `rows`
template <int d, class Scalar>
Eigen::Matrix<Scalar, d, d> products(const Eigen::MatrixXd &rows, const Eigen::Matrix<Scalar, Eigen::Dynamic, 1> &w,
                                     int a, int b) {
  constexpr int size = parts<Scalar>;
  double sum[size * d * d] = {};
  const double *w_ = parts_of(w.data());
  for (Index i = 0; i < w.size(); ++i) {
    const double *a_i = &rows(d * a, i), *b_i = &rows(d * b, i);
    for (int c = 0; c < d; ++c)
      for (int r = 0; r < d; ++r)
        for (int part = 0; part < size; ++part)
          sum[size * (d * c + r) + part] += w_[size * i + part] * (a_i[r] * b_i[c]);
  }
  return Eigen::Map<const Eigen::Matrix<Scalar, d, d>>(reinterpret_cast<const Scalar *>(sum));
}

} // namespace

template <class Space, class Scalar>
void NewtonTree<Space, Scalar>::eliminate_modes(const NewtonBody<Space> &body, const Scalar *E_, Node &node) {
  const int linked = body.linked();
  const Index n = body.modes(), size = d * (1 + linked);
  node.blocks.resize(size, size);
  block(node.blocks, 0, 0) = body.M.template cast<Scalar>();
  for (int k = 0; k < linked; ++k)
    block(node.blocks, 1 + k, 0) = body.X[static_cast<std::size_t>(k)].template cast<Scalar>();
  node.blocks.rightCols(size - d).setZero();
  const Eigen::Map<const Vector> E(E_, n);
  if (body.m_ff.size()) {
    const Matrix rows = body.rows.topRows(size).template cast<Scalar>();
    Matrix e = body.m_ff.template cast<Scalar>(), taken = E.asDiagonal() * body.p_by_A.template cast<Scalar>();
    e.diagonal() += E;
    node.e.compute(e);
    node.blocks.leftCols(d) += rows * node.e.solve(taken);
    if (linked > 0)
      node.blocks.rightCols(size - d) = rows * node.e.solve(rows.bottomRows(size - d).transpose());
    return;
  }
  node.inverse = (E.array() + Scalar(1)).inverse();
  const Vector taken = node.inverse.cwiseProduct(E);
  for (int k = 0; k <= linked; ++k)
    block(node.blocks, k, 0) += products<d>(body.rows, taken, k, 0);
  for (int k = 1; k <= linked; ++k)
    for (int l = 1; l <= linked; ++l)
      block(node.blocks, k, l) = products<d>(body.rows, node.inverse, k, l);
}

template <class Space, class Scalar>
void NewtonTree<Space, Scalar>::eliminate_ports(const NewtonBody<Space> &body, Node &node) {
  const int linked = body.linked();
  Matrix &all = node.blocks;
  node.ports.resize(body.children.size());
  for (int k = 0; k < static_cast<int>(body.children.size()); ++k) {
    const Square &Lambda = nodes_[static_cast<std::size_t>(body.children[static_cast<std::size_t>(k)])].Lambda;
    Port &port = node.ports[static_cast<std::size_t>(k)];
    port.passed = (Square::Identity() + Lambda * block(all, 1 + k, 1 + k)).inverse();
    port.Y.noalias() = port.passed * Lambda;
    const Square YX = port.Y * block(all, 1 + k, 0);
    block(all, 0, 0).noalias() += block(all, 1 + k, 0).transpose() * YX;
    for (int l = k + 1; l < linked; ++l) {
      block(all, 1 + l, 0).noalias() -= block(all, 1 + l, 1 + k) * YX;
      const Square GY = block(all, 1 + l, 1 + k) * port.Y;
      for (int m = k + 1; m < linked; ++m)
        block(all, 1 + l, 1 + m).noalias() -= GY * block(all, 1 + k, 1 + m);
    }
  }
  if (!body.is_moved)
    return;
  const auto X = block(all, linked, 0);
  node.M_inverse = block(all, 0, 0).inverse();
  node.N = Square(X * node.M_inverse * X.transpose() + block(all, linked, linked)).inverse();
}

template <class Space, class Scalar>
void NewtonTree<Space, Scalar>::eliminate_joint(const recursion::Node<Space> &joint, const NewtonBody<Space> &body,
                                                const Scalar *E, Node &node) {
  Square I = block(node.blocks, 0, 0);
  if (body.is_moved)
    I = body.tilt.transpose() * node.N * body.tilt;
  const auto J = body.J.template cast<Scalar>();
  const Index count = body.J.cols();
  const double rotor = joint.rotor_inertia, N = joint.gear_ratio, c = joint.rotor_turns;
  if (count > 0) {
    node.U.noalias() = I * J;
    Freedoms D = J.transpose() * node.U;
    D.diagonal() += Eigen::Map<const Along>(E, count);
    if (rotor > 0) {
      D(0, 0) += N * N * rotor;
      node.U(Space::axis, 0) += c * N * rotor;
      I(Space::axis, Space::axis) += c * c * rotor;
    }
    if (count == 1)
      node.D_inverse = D.cwiseInverse();
    else
      node.D_inverse = Freedoms(D.inverse());
    I.noalias() -= node.U * node.D_inverse * node.U.transpose();
  }
  node.Lambda.noalias() = body.to_section.transpose() * I * body.to_section;
}

template <class Space, class Scalar>
void NewtonTree<Space, Scalar>::factorise(const NewtonPosture<Space> &posture, const Vector &E) {
  posture_ = &posture;
  const Mechanism<Space> &m = posture.mechanism();
  nodes_.resize(m.nodes.size());
  A_port_.resize(static_cast<std::size_t>(m.ports));
  for (std::size_t i = nodes_.size(); i-- > 0;) {
    const NewtonBody<Space> &body = posture.body(i);
    eliminate_modes(body, E.data() + m.nodes[i].p_v(), nodes_[i]);
    eliminate_ports(body, nodes_[i]);
    eliminate_joint(m.nodes[i], body, E.data() + m.nodes[i].v, nodes_[i]);
  }
}

template <class Space, class Scalar>
void NewtonTree<Space, Scalar>::inward(const recursion::Node<Space> &joint, const NewtonBody<Space> &body, Scalar *x,
                                       Node &node) {
  const Index n = body.modes(), size = node.blocks.rows();
  const Eigen::Map<const Along> force(x + joint.v, body.J.cols());
  const Eigen::Map<const Vector> force_on_modes(x + joint.p_v(), n);
  node.u = force_on_modes;
  if (body.turn.size())
    node.u += force[0] * body.turn;
  if (body.m_ff.size())
    node.u = node.e.solve(node.u).eval();
  else
    node.u.array() *= node.inverse.array();
  node.motion.resize(size);
  for (int k = 0; k <= body.linked(); ++k)
    part(node.motion, k) = combined<d>(body.rows, node.u, k);
  node.forces.setZero(size);
  Six H = part(node.motion, 0);
  for (std::size_t k = 0; k < body.children.size(); ++k) {
    const int at = 1 + static_cast<int>(k);
    const Port &port = node.ports[k];
    const Six f = port.Y * part(node.motion, at) + port.passed * nodes_[static_cast<std::size_t>(body.children[k])].pi;
    H.noalias() += block(node.blocks, at, 0).transpose() * f;
    for (int l = at + 1; l <= body.linked(); ++l)
      part(node.motion, l).noalias() -= block(node.blocks, l, at) * f;
    part(node.forces, at) = -f;
  }
  if (body.is_moved) {
    const int at = body.linked();
    part(node.forces, 0) = node.M_inverse * H; // of the frame, no force acting at the section
    const Six moved = part(node.motion, at) - block(node.blocks, at, 0) * part(node.forces, 0);
    part(node.forces, at) = -(node.N * moved);
    H.noalias() = body.tilt.transpose() * part(node.forces, at);
  }
  node.pi = H;
  if (body.J.cols() > 0) {
    node.along.noalias() = node.D_inverse * (force - body.J.transpose() * H);
    node.pi.noalias() += node.U * node.along;
  }
  node.pi = (body.to_section.transpose() * node.pi).eval();
}

template <class Space, class Scalar>
void NewtonTree<Space, Scalar>::outward(const recursion::Node<Space> &joint, const NewtonBody<Space> &body, Scalar *x,
                                        Node &node) {
  const Index n = body.modes();
  Eigen::Map<Along> x_joint(x + joint.v, body.J.cols());
  Six A = Six::Zero();
  if (joint.parent >= 0)
    A.noalias() = body.to_section * A_port_[static_cast<std::size_t>(joint.parent_port)];
  if (body.J.cols() > 0) {
    x_joint = node.along - node.D_inverse * (node.U.transpose() * A);
    A.noalias() += body.J * x_joint;
  }
  if (body.is_moved) {
    const int at = body.linked();
    part(node.forces, at).noalias() += node.N * (body.tilt * A);
    A = node.M_inverse * (block(node.blocks, at, 0).transpose() * part(node.forces, at)) - part(node.forces, 0);
  }
  part(node.forces, 0) = -A;
  for (std::size_t k = body.children.size(); k-- > 0;) {
    const int at = 1 + static_cast<int>(k);
    Six there = block(node.blocks, at, 0) * A;
    for (int l = at + 1; l <= body.linked(); ++l)
      there.noalias() += block(node.blocks, l, at).transpose() * part(node.forces, l);
    part(node.forces, at).noalias() -= node.ports[k].Y * there;
    A_port_[static_cast<std::size_t>(joint.first_port + body.ports[k])] =
        there + part(node.motion, at) + block(node.blocks, at, at) * part(node.forces, at);
  }
  Eigen::Map<Vector> x_modes(x + joint.p_v(), n);
  if (body.m_ff.size())
    x_modes =
        node.u + node.e.solve(body.rows.topRows(node.forces.size()).transpose().template cast<Scalar>() * node.forces);
  else
    for (Index i = 0; i < n; ++i)
      x_modes[i] = node.u[i] + node.inverse[i] * times_column(body.rows, i, node.forces);
  if (body.turn.size())
    x_joint[0] += body.turn.cwiseProduct(x_modes).sum();
}

template <class Space, class Scalar> void NewtonTree<Space, Scalar>::solve(Scalar *x) {
  const Mechanism<Space> &m = posture_->mechanism();
  for (std::size_t i = nodes_.size(); i-- > 0;)
    inward(m.nodes[i], posture_->body(i), x, nodes_[i]);
  for (std::size_t i = 0; i < nodes_.size(); ++i)
    outward(m.nodes[i], posture_->body(i), x, nodes_[i]);
}

template class NewtonTree<Planar, double>;
template class NewtonTree<Planar, std::complex<double>>;
template class NewtonTree<Spatial, double>;
template class NewtonTree<Spatial, std::complex<double>>;

} // namespace ffrobot::recursion
