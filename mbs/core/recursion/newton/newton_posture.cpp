#include "core/recursion/newton/newton_posture.h"

#include "core/linear/products.h"
#include "core/linear/square.h"
#include "core/recursion/constrained_aba/once.h"

#include <Eigen/Cholesky>

namespace ffrobot::recursion {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

namespace {

using Padded = Eigen::Map<const RowMajor, 0, Eigen::OuterStride<>>;

// m and P at p, and the mass matrix of modes that are not orthonormal
void modal_rows(const planar::Body &body, const planar::State<double> &s, NewtonBody<Planar> &to) {
  const Eigen::Map<const MatrixXd> W = planar::rows_of(body, s);
  to.rows.topRows<3>() = W.topRows<3>();
  if (body.has_more)
    to.rows.row(planar::Body::H) += Eigen::Map<const VectorXd>(s.h.data(), body.n).transpose();
  for (std::size_t k = 0; k < to.ports.size(); ++k)
    to.rows.middleRows<3>(3 + 3 * static_cast<Index>(k)) =
        W.middleRows<3>(body.ports[static_cast<std::size_t>(to.ports[k])].row);
  if (!body.stiffening)
    return;
  to.m_ff = planar::bent_mass(body, s);
  to.p_by_A = to.m_ff.llt().solve(to.rows.topRows<3>().transpose());
}

void modal_rows(const spatial::Body &body, const spatial::State<double> &s, NewtonBody<Spatial> &to) {
  const bool bent = body.stiffening != nullptr; // rows there are W L^-T, m_ff = L L^T
  const int stride = padded(body.n);
  const Padded W(bent ? s.bent.rows.data() : body.rows.data(), body.width, body.n, Eigen::OuterStride<>(stride));
  to.rows.topRows<6>() = W.topRows<6>();
  for (std::size_t c = 0; c < body.twists.size() && !bent; ++c)
    for (int i = 3; i < 6; ++i)
      to.rows.row(i) += body.twists[c].axis[i] * Eigen::Map<const VectorXd>(s.h_change[c].data(), body.n).transpose();
  for (std::size_t k = 0; k < to.ports.size(); ++k) {
    const int port = to.ports[k];
    const auto &excess = s.ports[static_cast<std::size_t>(port)].excess;
    auto P = to.rows.middleRows<6>(6 + 6 * static_cast<Index>(k));
    P = W.middleRows<6>(body.ports[static_cast<std::size_t>(port)].row);
    if (body.ports[static_cast<std::size_t>(port)].is_flexible)
      P.bottomRows<3>() +=
          (Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(excess[0]) * P.bottomRows<3>()).eval();
  }
  if (!bent)
    return;
  const Padded factor(s.bent.factor.data(), body.n, body.n, Eigen::OuterStride<>(stride));
  const MatrixXd L = factor.triangularView<Eigen::Lower>();
  to.p_by_A = L.transpose().triangularView<Eigen::Upper>().solve(to.rows.topRows<6>().transpose());
  to.rows = (to.rows * L.transpose()).eval();
  to.m_ff = L * L.transpose();
}

VectorXd section_turn(const planar::Body &body) {
  return body.is_tilted
             ? VectorXd(Eigen::Map<const VectorXd>(body.rows.data() + planar::Body::TILT * body.padded, body.n))
             : VectorXd();
}
VectorXd section_turn(const spatial::Body &) { return {}; }

Eigen::Vector3d rates(const PlanarPlace<double> &at) { return {at.r_dot[0], at.r_dot[1], at.rate}; }
Eigen::Matrix<double, 6, 1> rates(const SpatialPlace<double> &at) {
  Eigen::Matrix<double, 6, 1> found;
  found << at.r_dot[0], at.r_dot[1], at.r_dot[2], at.w[0], at.w[1], at.w[2];
  return found;
}

template <int d> void copy(const Pack<double, d> *from, Eigen::Matrix<double, d, d> &to) {
  for (int i = 0; i < d; ++i)
    for (int j = 0; j < d; ++j)
      to(i, j) = from[i][j];
}

} // namespace

template <class Space>
NewtonPosture<Space>::NewtonPosture(const Mechanism<Space> &mechanism)
    : mechanism_(mechanism), bodies_(mechanism.nodes.size()),
      C_(MatrixXd::Zero(static_cast<Index>(mechanism.constraints.size()), mechanism.n_v)),
      rest_(VectorXd::Zero(mechanism.n_v)), acting_(static_cast<std::size_t>(mechanism.ports), Forces(d, C_.rows())) {
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    const Node<Space> &node = mechanism.nodes[i];
    NewtonBody<Space> &body = bodies_[i];
    std::vector<int> alone;
    for (int k = 0; k < node.outboard; ++k)
      if (const int child = mechanism.children[static_cast<std::size_t>(node.first_port + k)]; child >= 0)
        body.ports.push_back(k), body.children.push_back(child);
      else
        alone.push_back(k);
    body.is_moved = node.inboard >= 0;
    if (body.is_moved)
      body.ports.push_back(node.inboard);
    body.ports.insert(body.ports.end(), alone.begin(), alone.end());
    body.rows.resize(d * static_cast<Index>(1 + body.ports.size()), node.n());
    body.X.resize(body.ports.size());
    body.J.setZero(d, node.shape.v_count);
    body.turn = section_turn(node.body);
  }
}

template <class Space>
void NewtonPosture<Space>::take_body(std::size_t i, const double *q, Workspace<Space, double> &w) {
  const Node<Space> &node = mechanism_.nodes[i];
  NewtonBody<Space> &to = bodies_[i];
  auto &state = w.bodies[i];
  Pack<double, d> M[d], X[d], G[d];
  double bias[d];
  evaluate_inertia(node, q + node.p_q(), rest_.data(), state, M, bias);
  copy<d>(M, to.M);
  for (std::size_t k = 0; k < to.ports.size(); ++k) {
    port_rows(node.body, to.ports[k], state, X, bias, G);
    copy<d>(X, to.X[k]);
  }
  if (node.n())
    modal_rows(node.body, state, to);
}

template <class Space>
void NewtonPosture<Space>::take_joint(std::size_t i, const double *q, const Workspace<Space, double> &w) {
  const Node<Space> &node = mechanism_.nodes[i];
  const Hinge<Space, double> &hinge = w.hinges[i];
  NewtonBody<Space> &to = bodies_[i];
  for (int j = 0; j < d; ++j) {
    double unit[d] = {}, at_section[d];
    unit[j] = 1;
    hinge.turn.back(unit, at_section);
    if (!node.shape.is_centred)
      Space::template Turn<double>::shift(hinge.r, at_section);
    to.to_section.col(j) = Eigen::Map<const Eigen::Matrix<double, d, 1>>(at_section);
    if (!to.is_moved)
      continue;
    inboard_tilt(node, w.bodies[i]).apply(unit, at_section);
    to.tilt.col(j) = Eigen::Map<const Eigen::Matrix<double, d, 1>>(at_section);
  }
  for (int k = 0; k < node.shape.v_count; ++k) {
    double unit[6] = {};
    unit[k] = 1;
    std::conditional_t<d == 3, PlanarPlace<double>, SpatialPlace<double>> at;
    place(node.joint, node.lead, q + node.q, unit, at);
    to.J.col(k) = rates(at);
  }
}

// What a unit of each constraint does to the ports it acts on
template <class Space> void NewtonPosture<Space>::act(const Workspace<Space, double> &w) {
  for (Forces &forces : acting_)
    forces.setZero();
  ConstraintMotion<double> motion;
  double x[d];
  for (std::size_t r = 0; r < mechanism_.constraints.size(); ++r) {
    const Constraint &row = mechanism_.constraints[r];
    if (row.model.kind == ConstraintKind::coordinate)
      continue;
    constraint_motion(mechanism_, row, w, row.moves, motion);
    for (const auto &[at, sign, moment] : {std::tuple(&row.b, 1., motion.moment_b), {&row.a, -1., motion.moment_a}})
      if (at->node >= 0) {
        const auto node = static_cast<std::size_t>(at->node);
        in_port_axes(mechanism_.nodes[node].body, at->port, w.bodies[node], motion.force, moment, x);
        acting_[static_cast<std::size_t>(at->global_port)].col(static_cast<Index>(r)) +=
            sign * Eigen::Map<const Eigen::Matrix<double, d, 1>>(x);
      }
  }
}

// Rows of C are generalized forces of these: by virtual work, from the tips inwards.
template <class Space> void NewtonPosture<Space>::find_gradients(const Workspace<Space, double> &w) {
  using Port = typename NewtonBody<Space>::Square;
  act(w);
  for (std::size_t i = bodies_.size(); i-- > 0;) {
    const Node<Space> &node = mechanism_.nodes[i];
    const NewtonBody<Space> &body = bodies_[i];
    Forces on_frame = Forces::Zero(d, C_.rows());
    MatrixXd on_modes = MatrixXd::Zero(node.n(), C_.rows());
    const auto inboard = body.is_moved ? body.children.size() : body.ports.size();
    for (std::size_t k = 0; k < body.ports.size(); ++k)
      if (k != inboard) {
        const Forces &f = acting_[static_cast<std::size_t>(node.first_port + body.ports[k])];
        add_transposed_product(body.P(k), f, on_modes);
        add_transposed_product(body.X[k], f, on_frame);
      }
    const MatrixXd m = body.rows.template topRows<d>(); // X lacks P m_ff^-1 m^T
    const MatrixXd p_by_A = body.m_ff.size() ? body.p_by_A : MatrixXd(m.transpose());
    add_transposed_product(p_by_A, on_modes, on_frame);
    if (body.is_moved) {
      Port X = body.X[inboard];
      add_product(body.P(inboard), p_by_A, X);
      const Square<double, d> X_inverse = inverse(Square<double, d>::of(X));
      MatrixXd on_port = MatrixXd::Zero(d, on_frame.cols());
      add_transposed_product(Eigen::Map<const Port>(X_inverse.column[0].x), on_frame, on_port);
      add_transposed_product(body.P(inboard), on_port, on_modes, -1);
      on_frame.setZero();
      add_transposed_product(body.tilt, on_port, on_frame);
    }
    MatrixXd along = MatrixXd::Zero(body.J.cols(), on_frame.cols());
    add_transposed_product(body.J, on_frame, along);
    if (body.turn.size())
      add_product(body.turn, along, on_modes, -1);
    C_.middleCols(node.v, along.rows()) = along.transpose();
    C_.middleCols(node.p_v(), node.n()) = on_modes.transpose();
    if (node.parent >= 0)
      add_transposed_product(body.to_section, on_frame, acting_[static_cast<std::size_t>(node.parent_port)]);
  }
  for (std::size_t r = 0; r < mechanism_.constraints.size(); ++r)
    if (const Constraint &row = mechanism_.constraints[r]; row.node >= 0)
      C_(static_cast<Index>(r), mechanism_.nodes[static_cast<std::size_t>(row.node)].v + row.freedom) += row.share;
}

template <class Space> void NewtonPosture<Space>::take(const double *q, Workspace<Space, double> &w) {
  kinematics(mechanism_, q, rest_.data(), recursion::Forces<double>(), w);
  if (mechanism_.needs_positions)
    locate(mechanism_, q, w);
  for (std::size_t i = 0; i < bodies_.size(); ++i)
    take_body(i, q, w), take_joint(i, q, w);
  if (C_.rows())
    find_gradients(w);
}

template class NewtonPosture<Planar>;
template class NewtonPosture<Spatial>;

} // namespace ffrobot::recursion
