#include "core/recursion/newton/newton_tree.h"

#include <complex>

namespace ffrobot::recursion {

using Eigen::Index;

namespace {

// Products of real rows with numbers that may be complex are written for the parts of these: compilers take detours
// through memory otherwise.
template <class Scalar> constexpr int parts_in = static_cast<int>(sizeof(Scalar) / sizeof(double));
template <class Scalar> const double *parts_of(const Scalar *x) { return reinterpret_cast<const double *>(x); }

// Sum of x_i times columns i of `rows`, their part k
template <int d, class Scalar>
Column<Scalar, d> combined(const Eigen::MatrixXd &rows, const std::vector<Scalar> &x, int k) {
  constexpr int size = parts_in<Scalar>;
  double sum[size * d] = {};
  const double *x_ = parts_of(x.data());
  for (Index i = 0; i < rows.cols(); ++i) {
    const double *column = &rows(d * k, i);
    for (int c = 0; c < d; ++c)
      for (int part = 0; part < size; ++part)
        sum[size * c + part] += x_[size * i + part] * column[c];
  }
  Column<Scalar, d> found;
  std::copy_n(reinterpret_cast<const Scalar *>(sum), d, found.x);
  return found;
}

// Column i of `rows` times f, as far as f goes
template <int d, class Scalar>
Scalar times_column(const Eigen::MatrixXd &rows, Index i, const std::vector<Column<Scalar, d>> &f) {
  constexpr int size = parts_in<Scalar>;
  double sum[size] = {};
  const double *column = &rows(0, i), *f_ = parts_of(f.data()->x);
  for (Index c = 0; c < d * static_cast<Index>(f.size()); ++c)
    for (int part = 0; part < size; ++part)
      sum[part] += column[c] * f_[size * c + part];
  return *reinterpret_cast<const Scalar *>(sum);
}

// Sum of w_i a b^T over modes: a, b parts of columns i of `rows`
template <int d, class Scalar>
Square<Scalar, d> products(const Eigen::MatrixXd &rows, const std::vector<Scalar> &w, int a, int b) {
  constexpr int size = parts_in<Scalar>;
  double sum[size * d * d] = {};
  const double *w_ = parts_of(w.data());
  for (Index i = 0; i < rows.cols(); ++i) {
    const double *a_i = &rows(d * a, i), *b_i = &rows(d * b, i);
    for (int c = 0; c < d; ++c)
      for (int r = 0; r < d; ++r)
        for (int part = 0; part < size; ++part)
          sum[size * (d * c + r) + part] += w_[size * i + part] * (a_i[r] * b_i[c]);
  }
  Square<Scalar, d> found;
  std::copy_n(reinterpret_cast<const Scalar *>(sum), d * d, found.column[0].x);
  return found;
}

} // namespace

template <class Space, class Scalar>
void NewtonTree<Space, Scalar>::eliminate_modes(const NewtonBody<Space> &body, const Scalar *E, Node &node) {
  const auto n = static_cast<std::size_t>(body.modes());
  node.parts = 1 + body.linked();
  node.blocks.resize(static_cast<std::size_t>(node.parts * node.parts));
  node.block(0, 0) = Block::of(body.M);
  for (int k = 1; k < node.parts; ++k)
    node.block(k, 0) = Block::of(body.X[static_cast<std::size_t>(k - 1)]);
  if (body.m_ff.size()) {
    eliminate_bent_modes(body, E, node);
    return;
  }
  node.inverse.resize(n);
  std::vector<Scalar> &taken = node.u;
  taken.resize(n);
  for (std::size_t i = 0; i < n; ++i)
    node.inverse[i] = 1. / (1. + E[i]), taken[i] = node.inverse[i] * E[i];
  for (int k = 0; k < node.parts; ++k)
    node.block(k, 0) += products<d>(body.rows, taken, k, 0);
  for (int k = 1; k < node.parts; ++k)
    for (int l = 1; l < node.parts; ++l)
      node.block(k, l) = products<d>(body.rows, node.inverse, k, l);
}

// With m_ff + E in the place of 1 + E: column by column of what a part of the body does to modes
template <class Space, class Scalar>
void NewtonTree<Space, Scalar>::eliminate_bent_modes(const NewtonBody<Space> &body, const Scalar *E, Node &node) {
  const Index n = body.modes();
  typename Lu<Scalar>::Matrix e = body.m_ff.template cast<Scalar>();
  for (Index i = 0; i < n; ++i)
    e(i, i) += E[i];
  node.e.factorise(std::move(e));
  node.u.resize(static_cast<std::size_t>(n));
  for (int l = 0; l < node.parts; ++l)
    for (int c = 0; c < d; ++c) {
      for (Index i = 0; i < n; ++i)
        node.u[static_cast<std::size_t>(i)] = l ? Scalar(body.rows(d * l + c, i)) : E[i] * body.p_by_A(i, c);
      node.e.solve(node.u.data());
      for (int k = l ? 1 : 0; k < node.parts; ++k) {
        const Part found = combined<d>(body.rows, node.u, k);
        Part &to = node.block(k, l).column[c];
        to = l ? found : to + found;
      }
    }
}

template <class Space, class Scalar>
void NewtonTree<Space, Scalar>::eliminate_ports(const NewtonBody<Space> &body, Node &node) {
  node.ports.resize(body.children.size());
  for (int k = 1; k <= static_cast<int>(body.children.size()); ++k) {
    const auto child = static_cast<std::size_t>(body.children[static_cast<std::size_t>(k - 1)]);
    const Block &Lambda = nodes_[child].Lambda;
    Port &port = node.ports[static_cast<std::size_t>(k - 1)];
    port.passed = inverse(Block::identity() + Lambda * node.block(k, k));
    port.Y = port.passed * Lambda;
    const Block YX = port.Y * node.block(k, 0);
    node.block(0, 0) += node.block(k, 0).transpose() * YX;
    for (int l = k + 1; l < node.parts; ++l) {
      node.block(l, 0) -= node.block(l, k) * YX;
      const Block GY = node.block(l, k) * port.Y;
      for (int m = k + 1; m < node.parts; ++m)
        node.block(l, m) -= GY * node.block(k, m);
    }
  }
  if (!body.is_moved)
    return;
  const int at = node.parts - 1;
  const Block &X = node.block(at, 0);
  node.M_inverse = inverse(node.block(0, 0));
  node.N = inverse(X * node.M_inverse * X.transpose() + node.block(at, at));
}

template <class Space, class Scalar>
void NewtonTree<Space, Scalar>::eliminate_joint(const recursion::Node<Space> &joint, const NewtonBody<Space> &body,
                                                const Scalar *E, Node &node) {
  Block I = node.block(0, 0);
  if (body.is_moved) {
    node.tilt = Real::of(body.tilt);
    I = node.tilt.transpose() * node.N * node.tilt;
  }
  node.J = Real::of(body.J), node.to_section = Real::of(body.to_section);
  const int count = static_cast<int>(body.J.cols());
  const double rotor = joint.rotor_inertia, N = joint.gear_ratio, c = joint.rotor_turns;
  Block D;
  for (int j = 0; j < count; ++j) {
    node.U.column[j] = I * node.J.column[j];
    for (int i = 0; i < count; ++i)
      D(i, j) = dot(node.J.column[i], node.U.column[j]);
    D(j, j) += E[j];
  }
  if (rotor > 0 && count > 0) {
    D(0, 0) += N * N * rotor;
    node.U(Space::axis, 0) += c * N * rotor;
    I(Space::axis, Space::axis) += c * c * rotor;
  }
  node.D_inverse = inverse(D, count);
  for (int i = 0; i < count; ++i)
    for (int j = 0; j < count; ++j)
      for (int k = 0; k < d; ++k)
        I.column[k].add(-node.D_inverse(i, j) * node.U(k, j), node.U.column[i]);
  node.Lambda = node.to_section.transpose() * I * node.to_section;
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
  const int freedoms = static_cast<int>(body.J.cols());
  const Scalar *force_on_modes = x + joint.p_v();
  node.u.assign(force_on_modes, force_on_modes + body.modes());
  for (Index i = 0; i < body.turn.size(); ++i)
    node.u[static_cast<std::size_t>(i)] += x[joint.v] * body.turn[i];
  if (body.m_ff.size())
    node.e.solve(node.u.data());
  else
    for (std::size_t i = 0; i < node.u.size(); ++i)
      node.u[i] *= node.inverse[i];
  node.motion.resize(static_cast<std::size_t>(node.parts));
  node.forces.assign(node.motion.size(), Part());
  for (int k = 0; k < node.parts; ++k)
    node.motion[static_cast<std::size_t>(k)] = combined<d>(body.rows, node.u, k);
  Part H = node.motion[0];
  for (std::size_t k = 0; k < body.children.size(); ++k) {
    const int at = 1 + static_cast<int>(k);
    const Port &port = node.ports[k];
    const Part f = port.Y * node.motion[k + 1] + port.passed * nodes_[static_cast<std::size_t>(body.children[k])].pi;
    H += transposed_product(node.block(at, 0), f);
    for (int l = at + 1; l < node.parts; ++l)
      node.motion[static_cast<std::size_t>(l)] -= node.block(l, at) * f;
    node.forces[k + 1] = -f;
  }
  if (body.is_moved) {
    node.forces[0] = node.M_inverse * H; // of the frame, no force acting at the section
    const Part moved = node.motion.back() - node.block(node.parts - 1, 0) * node.forces[0];
    node.forces.back() = -(node.N * moved);
    H = transposed_product(node.tilt, node.forces.back());
  }
  Part left;
  for (int i = 0; i < freedoms; ++i)
    left[i] = x[joint.v + i] - dot(node.J.column[i], H);
  node.along = Part();
  for (int i = 0; i < freedoms; ++i) {
    for (int j = 0; j < freedoms; ++j)
      node.along[i] += node.D_inverse(i, j) * left[j];
    H.add(node.along[i], node.U.column[i]);
  }
  node.pi = transposed_product(node.to_section, H);
}

template <class Space, class Scalar>
void NewtonTree<Space, Scalar>::outward(const recursion::Node<Space> &joint, const NewtonBody<Space> &body, Scalar *x,
                                        Node &node) {
  const int freedoms = static_cast<int>(body.J.cols());
  Part A;
  if (joint.parent >= 0)
    A = node.to_section * A_port_[static_cast<std::size_t>(joint.parent_port)];
  Part there;
  for (int i = 0; i < freedoms; ++i)
    there[i] = dot(node.U.column[i], A);
  for (int i = 0; i < freedoms; ++i) {
    x[joint.v + i] = node.along[i];
    for (int j = 0; j < freedoms; ++j)
      x[joint.v + i] -= node.D_inverse(i, j) * there[j];
    A.add(x[joint.v + i], node.J.column[i]);
  }
  if (body.is_moved) {
    node.forces.back() += node.N * (node.tilt * A);
    A = node.M_inverse * transposed_product(node.block(node.parts - 1, 0), node.forces.back()) - node.forces[0];
  }
  node.forces[0] = -A;
  for (std::size_t k = body.children.size(); k-- > 0;) {
    const int at = 1 + static_cast<int>(k);
    there = node.block(at, 0) * A;
    for (int l = at + 1; l < node.parts; ++l)
      there += transposed_product(node.block(l, at), node.forces[static_cast<std::size_t>(l)]);
    node.forces[k + 1] -= node.ports[k].Y * there;
    A_port_[static_cast<std::size_t>(joint.first_port + body.ports[k])] =
        there + node.motion[k + 1] + node.block(at, at) * node.forces[k + 1];
  }
  Scalar *x_modes = x + joint.p_v();
  const auto n = static_cast<std::size_t>(body.modes());
  std::vector<Scalar> &by_forces = x_of_modes_;
  by_forces.resize(n);
  for (std::size_t i = 0; i < n; ++i)
    by_forces[i] = times_column(body.rows, static_cast<Index>(i), node.forces);
  if (body.m_ff.size())
    node.e.solve(by_forces.data());
  else
    for (std::size_t i = 0; i < n; ++i)
      by_forces[i] *= node.inverse[i];
  for (std::size_t i = 0; i < n; ++i)
    x_modes[i] = node.u[i] + by_forces[i];
  for (Index i = 0; i < body.turn.size(); ++i)
    x[joint.v] += body.turn[i] * x_modes[i];
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
