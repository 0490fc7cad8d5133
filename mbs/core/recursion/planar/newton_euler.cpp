#include "core/recursion/planar/newton_euler.h"

#include "core/recursion/rows.h"

#include <algorithm>
#include <cmath>

namespace ffrobot::recursion {

using Eigen::Index;
using Eigen::VectorXd;
using planar::Body;

namespace {

using State = planar::State<double>;
using Vector = NewtonEuler::Vector;
using Turn = PlanarTurn<double>;

std::array<double, 2> place(const planar::Port &port, const State &s) {
  const auto row = static_cast<std::size_t>(port.row);
  return {port.x + s.u[row], port.y + s.u[row + 1]};
}

// Of rows of W: W p_ddot, with geometric stiffening less p_dot^T K p_dot
VectorXd elastic_accelerations(const Node<Planar> &node, const State &s, const double *a) {
  if (node.n() == 0)
    return VectorXd::Zero(node.body.width());
  VectorXd found = planar::rows_of(node.body, s).lazyProduct(Eigen::Map<const VectorXd>(a + node.p_v(), node.n()));
  if (node.body.stiffening)
    found -= Eigen::Map<const VectorXd>(s.bent.curvature.data(), found.size());
  return found;
}

// Of a port against the frame: what its acceleration has beside the frame's linear one. alpha: of the frame
Vector relative_acceleration(const planar::Port &port, const State &s, double alpha, const VectorXd &u_ddot) {
  const auto [x, y] = place(port, s);
  const double *u_dot = s.u_dot.data() + port.row, *elastic = u_ddot.data() + port.row;
  const double ww = s.omega * s.omega, w2 = 2 * s.omega;
  return {-alpha * y - ww * x - w2 * u_dot[1] + elastic[0], alpha * x - ww * y + w2 * u_dot[0] + elastic[1],
          elastic[2]};
}

// M_rr A + m p_ddot - Q_r: force and moment about the origin of the frame. u_ddot: W p_ddot
Vector inertia_force(const Body &b, const State &s, const Vector &A, const double *p_ddot, const VectorXd &u_ddot) {
  const double ww = s.omega * s.omega, w2 = 2 * s.omega;
  const double sx = b.sx + s.u[Body::Sx], sy = b.sy + s.u[Body::Sy];
  double h_p_ddot = u_ddot[Body::H];
  for (int k = 0; b.has_more && k < b.n; ++k)
    h_p_ddot += s.h[static_cast<std::size_t>(k)] * p_ddot[k];
  return {b.mass * A[0] - A[2] * sy - ww * sx - w2 * s.u_dot[Body::Sy] + u_ddot[Body::Sx],
          b.mass * A[1] + A[2] * sx - ww * sy + w2 * s.u_dot[Body::Sx] + u_ddot[Body::Sy],
          sx * A[1] - sy * A[0] + (b.J + s.p_p) * A[2] + w2 * s.p_v + h_p_ddot};
}

// A force at `from`, and its moment about the origin
void add_moment_of(const std::array<double, 2> &from, Vector &f) { Turn::add_moment(from.data(), f.data()); }

void add(const Vector &x, Vector &to, double factor = 1) {
  for (std::size_t i = 0; i < 3; ++i)
    to[i] += factor * x[i];
}

double product(const Vector &x, const Vector &y) { return x[0] * y[0] + x[1] * y[1] + x[2] * y[2]; }

// What a unit of its multiplier makes of a row, or a wrench, at the port where it acts: in axes of that
Vector in_port_axes_of(const Mechanism<Planar> &m, const Mechanism<Planar>::Actions &at, const Action &action,
                       const double *wrench, const Workspace<Planar, double> &w) {
  const auto &body = m.nodes[static_cast<std::size_t>(at.node)].body;
  const State &s = w.bodies[static_cast<std::size_t>(at.node)];
  Vector x{};
  if (action.row < 0) {
    const double *from = wrench + 3 * action.wrench, force[3] = {from[0], from[1], 0}, moment[3] = {0, 0, from[2]};
    in_port_axes(body, at.port, s, force, moment, x.data());
    return x;
  }
  if (action.is_point) {
    const double moment[3] = {};
    in_port_axes(body, at.port, s, action.force, moment, x.data());
    return x;
  }
  const Row &row = m.rows[static_cast<std::size_t>(action.row)];
  RowMotion<double> motion;
  row_motion(m, row, w, row.moves, motion);
  in_port_axes(body, at.port, s, motion.force, action.sign > 0 ? motion.moment_b : motion.moment_a, x.data());
  for (double &component : x)
    component *= action.sign;
  return x;
}

} // namespace

NewtonEuler::NewtonEuler(const Mechanism<Planar> &mechanism)
    : mechanism_(mechanism), ports_(static_cast<std::size_t>(mechanism.ports)), on_ports_(ports_), with_joints_(ports_),
      terms_(ports_.size()), frames_(mechanism.nodes.size()), inertia_(frames_), rotor_(inertia_.size()),
      on_coordinates_(VectorXd::Zero(mechanism.n_v)), of_joint_(inertia_), in_global_axes_(inertia_),
      at_section_(inertia_), about_inner_(rotor_) {}

void NewtonEuler::prepare(const double *q, const double *v, const double *generalized,
                          Workspace<Planar, double> &w) const {
  kinematics(mechanism_, q, v, Forces<double>{generalized, nullptr}, w);
  locate(mechanism_, q, w);
  for (std::size_t i = 0; i < mechanism_.nodes.size(); ++i) {
    const Node<Planar> &node = mechanism_.nodes[i];
    forces_on_rows(node.body, q + node.p_q(), v + node.p_v(), w.bodies[i]);
  }
}

void NewtonEuler::accelerate(const double *q, const double *a, const Workspace<Planar, double> &w) {
  for (std::size_t i = 0; i < mechanism_.nodes.size(); ++i) {
    const Node<Planar> &node = mechanism_.nodes[i];
    const State &s = w.bodies[i];
    const auto &hinge = w.hinges[i];
    const Vector ground{-mechanism_.gravity[0], -mechanism_.gravity[1], 0};
    Vector A;
    hinge.turn.back((node.parent < 0 ? ground : ports_[static_cast<std::size_t>(node.parent_port)]).data(), A.data());
    if (node.rotor_inertia > 0)
      rotor_[i] = node.rotor_inertia * (node.rotor_turns * A[2] + node.gear_ratio * a[node.v]);
    Turn::shift(hinge.r, A.data());
    Vector along{};
    for (int k = 0; k < node.shape.freedoms.count; ++k)
      along[static_cast<std::size_t>(node.shape.freedoms.component[k])] = a[node.v + k];
    if (node.shape.in_inner_axes) {
      const Vector inner = along;
      to_outer_axes(node, q + node.q, inner.data(), along.data());
    }
    add(along, A);
    for (std::size_t k = 0; k < 3; ++k)
      A[k] += hinge.c[k];
    const VectorXd u_ddot = elastic_accelerations(node, s, a);
    if (node.inboard >= 0) { // from the section to the frame
      const planar::Port &port = node.body.ports[static_cast<std::size_t>(node.inboard)];
      Vector section = A;
      inboard_tilt(node, s).apply(section.data(), A.data());
      A[2] -= u_ddot[port.row + 2];
      const Vector relative = relative_acceleration(port, s, A[2], u_ddot);
      A[0] -= relative[0], A[1] -= relative[1];
    } else if (node.body.is_tilted)
      A[2] -= u_ddot[Body::TILT];
    for (int k = 0; k < node.outboard; ++k) {
      const planar::Port &port = node.body.ports[static_cast<std::size_t>(k)];
      const auto at = static_cast<std::size_t>(node.first_port + k);
      ports_[at] = relative_acceleration(port, s, A[2], u_ddot);
      add(A, ports_[at]);
      const double *modal = s.Q.data() + port.row; // W Q_f
      terms_[at] = std::abs(modal[0]) + std::abs(modal[1]) + std::abs(modal[2]);
    }
    inertia_[i] = inertia_force(node.body, s, A, a + node.p_v(), u_ddot);
    frames_[i] = A;
  }
}

void NewtonEuler::leave_frames(Workspace<Planar, double> &w) const {
  for (std::size_t i = 0; i < frames_.size(); ++i)
    std::copy_n(frames_[i].data(), 3, w.bodies[i].A);
}

void NewtonEuler::load(const double *lambda, const double *wrench, const Workspace<Planar, double> &w) {
  std::fill(on_ports_.begin(), on_ports_.end(), Vector{});
  for (const auto &actions : mechanism_.actions)
    for (const Action &action : actions.list) {
      const double size = action.row < 0 ? wrench != nullptr : lambda ? -lambda[action.row] : 0;
      if (size != 0)
        add(in_port_axes_of(mechanism_, actions, action, wrench, w),
            on_ports_[static_cast<std::size_t>(actions.global_port)], size);
    }
  on_coordinates_.setZero();
  for (std::size_t r = 0; lambda && r < mechanism_.rows.size(); ++r)
    if (const Row &row = mechanism_.rows[r]; row.node >= 0)
      on_coordinates_[mechanism_.nodes[static_cast<std::size_t>(row.node)].v + row.freedom] -= row.share * lambda[r];
}

void NewtonEuler::transmit(const Workspace<Planar, double> &w) { inward(true, w); }

void NewtonEuler::inward(bool with_inertia, const Workspace<Planar, double> &w) {
  with_joints_ = on_ports_;
  for (std::size_t i = mechanism_.nodes.size(); i-- > 0;) {
    const Node<Planar> &node = mechanism_.nodes[i];
    const State &s = w.bodies[i];
    Vector f = with_inertia ? inertia_[i] : Vector{};
    for (int k = 0; k < node.outboard; ++k) {
      Vector at_port = with_joints_[static_cast<std::size_t>(node.first_port + k)];
      add_moment_of(place(node.body.ports[static_cast<std::size_t>(k)], s), at_port);
      add(at_port, f, -1);
    }
    if (node.inboard >= 0) {
      const auto [x, y] = place(node.body.ports[static_cast<std::size_t>(node.inboard)], s);
      add_moment_of({-x, -y}, f);
    }
    at_section_[i] = in_global_axes_[i] = of_joint_[i] = f;
    Turn{s.absolute_cosine, s.absolute_sine}.apply(f.data(), in_global_axes_[i].data());
    if (node.inboard >= 0)
      inboard_tilt(node, s).back(f.data(), of_joint_[i].data());
    Vector on_inner = of_joint_[i], turned;
    Turn::add_moment(w.hinges[i].r, on_inner.data());
    about_inner_[i] = on_inner[2];
    if (node.parent < 0)
      continue;
    if (with_inertia)
      on_inner[2] += node.rotor_turns * rotor_[i];
    w.hinges[i].turn.apply(on_inner.data(), turned.data());
    add(turned, with_joints_[static_cast<std::size_t>(node.parent_port)], -1);
  }
}

// Of what joint i transmits, by its free components
NewtonEuler::Vector NewtonEuler::along_joint(std::size_t i, const double *q) const {
  const Node<Planar> &node = mechanism_.nodes[i];
  Vector along = of_joint_[i], found{};
  if (node.shape.in_inner_axes)
    to_inner_axes(node, q + node.q, of_joint_[i].data(), along.data());
  for (std::size_t k = 0; k < static_cast<std::size_t>(node.shape.freedoms.count); ++k)
    found[k] = along[static_cast<std::size_t>(node.shape.freedoms.component[k])];
  return found;
}

// act(row of W, force): on the ports of body i, and what its joint does to the section that modes move against the
// frame
template <class Act> void NewtonEuler::on_rows(std::size_t i, const Act &act) const {
  const Node<Planar> &node = mechanism_.nodes[i];
  const auto put = [&](int port, const Vector &f) {
    for (Index k = 0; k < 3; ++k)
      act(node.body.ports[static_cast<std::size_t>(port)].row + k, f[static_cast<std::size_t>(k)]);
  };
  for (int k = 0; k < node.outboard; ++k)
    put(k, with_joints_[static_cast<std::size_t>(node.first_port + k)]);
  if (node.inboard >= 0)
    put(node.inboard, at_section_[i]);
  else if (node.body.is_tilted)
    act(Body::TILT, at_section_[i][2]);
}

void NewtonEuler::project_on_joints(const double *q, const Workspace<Planar, double> &w, double *Q) {
  inward(false, w);
  for (std::size_t i = 0; i < mechanism_.nodes.size(); ++i) {
    const Node<Planar> &node = mechanism_.nodes[i];
    const Vector along = along_joint(i, q);
    for (int k = 0; k < node.shape.freedoms.count; ++k)
      Q[node.v + k] = on_coordinates_[node.v + k] - along[static_cast<std::size_t>(k)];
  }
}

void NewtonEuler::project(const double *q, const Workspace<Planar, double> &w, double *Q) {
  project_on_joints(q, w, Q);
  for (std::size_t i = 0; i < mechanism_.nodes.size(); ++i) {
    const Node<Planar> &node = mechanism_.nodes[i];
    if (node.n() == 0)
      continue;
    const Body &body = node.body;
    double *modal = Q + node.p_v();
    if (body.stiffening) {
      const auto W = planar::rows_of(body, w.bodies[i]);
      Eigen::Map<VectorXd> sum(modal, node.n());
      sum.setZero();
      on_rows(i, [&](Index row, double force) { sum += force * W.row(row).transpose(); });
    } else
      in_registers(node.n(), [&]<int width>(long k) { // the same of rows that are constant
        using Part = Pack<double, width>;
        const double *W = body.rows.data() + k;
        Part sum = Part::zero();
        on_rows(i, [&](Index row, double force) { sum += force * Part::read(W + row * body.padded); });
        sum.write(modal + k);
      });
  }
}

void NewtonEuler::require(const double *q, const double *a, Workspace<Planar, double> &w, double *f) {
  inward(true, w);
  for (std::size_t i = 0; i < mechanism_.nodes.size(); ++i) {
    const Node<Planar> &node = mechanism_.nodes[i];
    const Vector along = along_joint(i, q);
    for (int k = 0; k < node.shape.freedoms.count; ++k)
      f[node.v + k] = along[static_cast<std::size_t>(k)] - on_coordinates_[node.v + k];
    if (node.rotor_inertia > 0)
      f[node.v] += node.gear_ratio * rotor_[i];
    if (node.n() == 0)
      continue;
    VectorXd z = VectorXd::Zero(node.body.width()), by_forces(node.n());
    for (std::size_t k = 0; k < 3; ++k)
      z[static_cast<Index>(k)] = -frames_[i][k];
    on_rows(i, [&](Index row, double force) { z[row] += force; });
    modal_accelerations<false>(node.body, q + node.p_q(), z.data(), w.bodies[i], by_forces.data());
    const VectorXd beside = Eigen::Map<const VectorXd>(a + node.p_v(), node.n()) - by_forces;
    Eigen::Map<VectorXd> modal(f + node.p_v(), node.n());
    if (node.body.stiffening)
      modal = bent_mass(node.body, w.bodies[i]) * beside;
    else
      modal = beside;
  }
}

NewtonEuler::RowAcceleration NewtonEuler::of_row(std::size_t r, const double *a,
                                                 const Workspace<Planar, double> &w) const {
  const Row &row = mechanism_.rows[r];
  const double along_joint =
      row.node < 0 ? 0 : row.share * a[mechanism_.nodes[static_cast<std::size_t>(row.node)].v + row.freedom];
  RowMotion<double> motion;
  row_motion(mechanism_, row, w, row.moves, motion);
  const double along = mechanism_.gravity[0] * motion.force[0] + mechanism_.gravity[1] * motion.force[1];
  const double lift = ((row.a.node < 0) - (row.b.node < 0)) * along;
  RowAcceleration found{along_joint + motion.bias + lift,
                        std::abs(along_joint) + std::abs(motion.bias) + std::abs(lift)};
  for (const auto &actions : mechanism_.actions)
    for (const Action &action : actions.list)
      if (action.row == static_cast<int>(r)) {
        const auto port = static_cast<std::size_t>(actions.global_port);
        const Vector x = in_port_axes_of(mechanism_, actions, action, nullptr, w);
        found.value += product(x, ports_[port]);
        for (std::size_t k = 0; k < 3; ++k)
          found.size += std::abs(x[k]) * (std::abs(ports_[port][k]) + terms_[port]);
      }
  return found;
}

} // namespace ffrobot::recursion
