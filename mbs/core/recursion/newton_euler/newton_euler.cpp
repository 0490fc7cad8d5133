#include "core/recursion/newton_euler/newton_euler.h"

#include "core/recursion/constrained_aba/once.h"

namespace ffrobot::recursion {

namespace {

template <std::size_t n> void add(const std::array<double, n> &x, std::array<double, n> &to, double factor = 1) {
  for (std::size_t i = 0; i < n; ++i)
    to[i] += factor * x[i];
}

template <std::size_t n> double product(const std::array<double, n> &x, const std::array<double, n> &y) {
  double sum = 0;
  for (std::size_t i = 0; i < n; ++i)
    sum += x[i] * y[i];
  return sum;
}

// Acceleration of the outer section by accelerations a of its joint's coordinates, in axes of that section
template <class Space>
std::array<double, Space::dim> acceleration_of_joint(const Node<Space> &node, const Hinge<Space, double> &hinge,
                                                     const double *q, const double *a) {
  std::array<double, Space::dim> along{};
  for (int k = 0; k < node.shape.freedoms.count; ++k)
    along[node.shape.freedoms.component[k]] = a[k];
  if (node.shape.in_inner_axes) {
    const auto inner = along;
    change_section<false>(node, q, inner.data(), along.data());
  }
  acceleration_by_freedoms<-1>(node, hinge, along.data());
  return along;
}

// From axes of the section that the joint holds, undeformed
template <class Space, class State>
void section_to_global(const Node<Space> &node, const State &s, const double *x, double *y) {
  if (node.inboard >= 0)
    port_to_global(node.body, node.inboard, s, x, y);
  else
    body_to_global(s, x, y);
}

// What a unit of its multiplier makes of a constraint, or a wrench, at the port where it acts: in axes of that
template <class Space>
std::array<double, Space::dim> in_port_axes_of(const typename Mechanism<Space>::Actions &at, const Action &action,
                                               const double *wrench, const Workspace<Space, double> &w) {
  const auto &body = w.m.nodes[at.node].body;
  const auto &s = w.bodies[at.node];
  std::array<double, Space::dim> x{};
  if (action.constraint < 0) {
    const double *from = wrench + Space::dim * action.wrench;
    double force[3] = {}, moment[3] = {};
    std::copy_n(from, Space::linear, force);
    std::copy_n(from + Space::linear, Space::dim - Space::linear, moment + (Space::dim == 3 ? 2 : 0));
    in_port_axes(body, at.port, s, force, moment, x.data());
    return x;
  }
  if (action.is_point) {
    const double moment[3] = {};
    in_port_axes(body, at.port, s, action.force, moment, x.data());
    return x;
  }
  const Constraint &row = w.m.constraints[action.constraint];
  ConstraintMotion<double> motion;
  constraint_motion(row, w, row.moves, motion);
  in_port_axes(body, at.port, s, motion.force, action.sign > 0 ? motion.moment_b : motion.moment_a, x.data());
  for (double &component : x)
    component *= action.sign;
  return x;
}

} // namespace

template <class Space>
NewtonEuler<Space>::NewtonEuler(const Mechanism<Space> &mechanism)
    : mechanism_(mechanism), ports_(mechanism.ports), on_ports_(ports_), with_joints_(ports_), terms_(ports_.size()),
      frames_(mechanism.nodes.size()), inertia_(frames_), rotor_(inertia_.size()),
      on_coordinates_(VectorXd::Zero(mechanism.n_v)), of_joint_(inertia_), at_section_(inertia_), of_rotor_(inertia_) {
  for (const auto &node : mechanism.nodes)
    bodies_.emplace_back(node.body);
}

template <class Space>
void NewtonEuler<Space>::prepare(const double *q, const double *v, const double *generalized,
                                 Workspace<Space, double> &w) {
  kinematics(q, v, recursion::Forces<double>{generalized, nullptr}, w);
  locate(q, w);
  for (std::size_t i = 0; i < mechanism_.nodes.size(); ++i) {
    const Node<Space> &node = mechanism_.nodes[i];
    bodies_[i].take(node.body, q + node.p_q(), v + node.p_v(), w.bodies[i]);
  }
}

template <class Space>
void NewtonEuler<Space>::accelerate(const double *q, const double *a, const Workspace<Space, double> &w) {
  for (std::size_t i = 0; i < mechanism_.nodes.size(); ++i) {
    const Node<Space> &node = mechanism_.nodes[i];
    const auto &body = node.body;
    const auto &s = w.bodies[i];
    const auto &hinge = w.hinges[i];
    Vector ground{}, A;
    if (node.parent < 0)
      ground_acceleration(mechanism_, node.parent_port, ground.data());
    hinge.turn.back((node.parent < 0 ? ground : ports_[node.parent_port]).data(), A.data());
    if (node.rotor_inertia > 0)
      rotor_[i] = node.rotor_inertia * (node.rotor_turns * A[Space::axis] + node.gear_ratio * a[node.v]);
    hinge.turn.shift(hinge.r, A.data());
    add(acceleration_of_joint(node, hinge, q + node.q, a + node.v), A);
    for (std::size_t k = 0; k < A.size(); ++k)
      A[k] += hinge.c[k];
    const VectorXd u_ddot = elastic_accelerations(body, s, a + node.p_v());
    if (node.inboard >= 0) { // from the section to the frame
      Vector at_port;
      inboard_tilt(node, s).apply(A.data(), at_port.data());
      A = frame_acceleration(body, node.inboard, s, at_port, u_ddot);
    } else
      tilt_back(body, u_ddot, A);
    for (int k = 0; k < node.outboard; ++k) {
      const std::size_t at = node.first_port + k;
      ports_[at] = port_acceleration(body, k, s, A, u_ddot);
      terms_[at] = modal_terms(body, k, s);
    }
    inertia_[i] = inertia_force(body, bodies_[i], s, A, a + node.p_v(), u_ddot);
    frames_[i] = A;
  }
}

template <class Space> void NewtonEuler<Space>::leave_frames(Workspace<Space, double> &w) const {
  for (std::size_t i = 0; i < frames_.size(); ++i)
    std::copy_n(frames_[i].data(), Space::dim, w.bodies[i].A);
}

template <class Space>
void NewtonEuler<Space>::load(const double *lambda, const double *wrench, const Workspace<Space, double> &w) {
  std::fill(on_ports_.begin(), on_ports_.end(), Vector{});
  for (const auto &actions : mechanism_.actions)
    for (const Action &action : actions.list) {
      const double size = action.constraint < 0 ? wrench != nullptr : lambda ? -lambda[action.constraint] : 0;
      if (size != 0)
        add(in_port_axes_of(actions, action, wrench, w), on_ports_[actions.global_port], size);
    }
  on_coordinates_.setZero();
  for (std::size_t r = 0; lambda && r < mechanism_.constraints.size(); ++r)
    if (const Constraint &row = mechanism_.constraints[r]; row.node >= 0)
      on_coordinates_[mechanism_.nodes[row.node].v + row.freedom] -= row.share * lambda[r];
}

template <class Space> void NewtonEuler<Space>::transmit(const Workspace<Space, double> &w, bool with_inertia) {
  with_joints_ = on_ports_;
  for (std::size_t i = mechanism_.nodes.size(); i-- > 0;) {
    const Node<Space> &node = mechanism_.nodes[i];
    const auto &s = w.bodies[i];
    const auto &hinge = w.hinges[i];
    Vector f = with_inertia ? inertia_[i] : Vector{};
    for (int k = 0; k < node.outboard; ++k) {
      Vector at_port = with_joints_[node.first_port + k];
      to_frame(node.body, k, s, at_port);
      add(at_port, f, -1);
    }
    if (node.inboard >= 0)
      to_port(node.body, node.inboard, s, f);
    at_section_[i] = of_joint_[i] = f;
    if (node.inboard >= 0)
      inboard_tilt(node, s).back(f.data(), of_joint_[i].data());
    Vector on_inner = of_joint_[i], turned;
    hinge.turn.add_moment(hinge.r, on_inner.data());
    if (with_inertia && node.rotor_inertia > 0) {
      Vector moment{}, at_section;
      moment[Space::axis] = node.rotor_turns * rotor_[i];
      if constexpr (Space::dim == 6)
        moment[3] = hinge.gyro[0], moment[4] = hinge.gyro[1];
      add(moment, on_inner);
      at_section = moment;
      if (node.inboard >= 0)
        inboard_tilt(node, s).apply(moment.data(), at_section.data());
      section_to_global(node, s, at_section.data(), of_rotor_[i].data());
    }
    if (node.parent < 0)
      continue;
    hinge.turn.apply(on_inner.data(), turned.data());
    add(turned, with_joints_[node.parent_port], -1);
  }
}

template <class Space>
typename NewtonEuler<Space>::Vector NewtonEuler<Space>::in_global_axes(std::size_t i,
                                                                       const Workspace<Space, double> &w) const {
  Vector found;
  section_to_global(mechanism_.nodes[i], w.bodies[i], at_section_[i].data(), found.data());
  return found;
}

// Of what joint i transmits, by its free components
template <class Space>
typename NewtonEuler<Space>::Vector NewtonEuler<Space>::along_joint(std::size_t i, const double *q,
                                                                    const Workspace<Space, double> &w) const {
  const Node<Space> &node = mechanism_.nodes[i];
  Vector along = of_joint_[i], found{};
  if (node.shape.in_inner_axes)
    change_section<true>(node, q + node.q, of_joint_[i].data(), along.data());
  forces_by_freedoms<1>(node, w.hinges[i], along.data());
  for (std::size_t k = 0; k < static_cast<std::size_t>(node.shape.freedoms.count); ++k)
    found[k] = along[node.shape.freedoms.component[k]];
  return found;
}

// act(row of W, force): on the ports of body i, and what its joint does to the section that modes move against the
// frame
template <class Space>
template <class Act>
void NewtonEuler<Space>::on_constraints(std::size_t i, const Workspace<Space, double> &w, const Act &act) const {
  const Node<Space> &node = mechanism_.nodes[i];
  for (int k = 0; k < node.outboard; ++k)
    put_on_rows(node.body, k, w.bodies[i], with_joints_[node.first_port + k], act);
  if (node.inboard >= 0)
    put_on_rows(node.body, node.inboard, w.bodies[i], at_section_[i], act);
  else
    on_tilt(node.body, at_section_[i], act);
}

template <class Space> void NewtonEuler<Space>::project(const double *q, const Workspace<Space, double> &w, double *Q) {
  transmit(w, false);
  for (std::size_t i = 0; i < mechanism_.nodes.size(); ++i) {
    const Node<Space> &node = mechanism_.nodes[i];
    const Vector along = along_joint(i, q, w);
    for (int k = 0; k < node.shape.freedoms.count; ++k)
      Q[node.v + k] = on_coordinates_[node.v + k] - along[k];
    if (node.n() > 0)
      put_on_modes(node.body, w.bodies[i], [&](const auto &act) { on_constraints(i, w, act); }, Q + node.p_v());
  }
}

template <class Space>
void NewtonEuler<Space>::require(const double *q, const double *a, Workspace<Space, double> &w, double *f) {
  transmit(w);
  for (std::size_t i = 0; i < mechanism_.nodes.size(); ++i) {
    const Node<Space> &node = mechanism_.nodes[i];
    const Vector along = along_joint(i, q, w);
    for (int k = 0; k < node.shape.freedoms.count; ++k)
      f[node.v + k] = along[k] - on_coordinates_[node.v + k];
    if (node.rotor_inertia > 0)
      f[node.v] += node.gear_ratio * rotor_[i];
    if (node.n() == 0)
      continue;
    VectorXd z = VectorXd::Zero(node.body_width());
    on_constraints(i, w, [&](Index row, double force) { z[row] += force; });
    residual_of_modes(i, q, a, z, w, f);
  }
}

template <class Space>
void NewtonEuler<Space>::require_of_modes(const double *q, const double *a, Workspace<Space, double> &w, double *f) {
  std::fill_n(f, mechanism_.n_v, 0.);
  for (std::size_t i = 0; i < mechanism_.nodes.size(); ++i)
    if (const Node<Space> &node = mechanism_.nodes[i]; node.n() > 0) {
      VectorXd z = VectorXd::Zero(node.body_width());
      residual_of_modes(i, q, a, z, w, f);
    }
}

// z: forces on ports by rows of W; the frame's acceleration joins them
template <class Space>
void NewtonEuler<Space>::residual_of_modes(std::size_t i, const double *q, const double *a, VectorXd &z,
                                           Workspace<Space, double> &w, double *f) {
  const Node<Space> &node = mechanism_.nodes[i];
  for (std::size_t k = 0; k < frames_[i].size(); ++k)
    z[k] -= frames_[i][k];
  modal_residual(node, q + node.p_q(), a + node.p_v(), z.data(), w.bodies[i], f + node.p_v());
}

template <class Space>
void NewtonEuler<Space>::add_joint_moment_on_modes(std::size_t i, double moment, const Workspace<Space, double> &w,
                                                   double *Q) const {
  const auto add_to = [&](std::size_t at, const auto &put) {
    const Node<Space> &node = mechanism_.nodes[at];
    if (node.n() == 0)
      return;
    VectorXd modal(node.n());
    put_on_modes(node.body, w.bodies[at], put, modal.data());
    Map<VectorXd>(Q + node.p_v(), node.n()) += modal;
  };
  const Node<Space> &node = mechanism_.nodes[i];
  Vector about_z{}, at_port{};
  about_z[Space::axis] = moment;
  add_to(i, [&](const auto &act) {
    if (node.inboard < 0)
      return on_tilt(node.body, about_z, act);
    inboard_tilt(node, w.bodies[i]).apply(about_z.data(), at_port.data());
    put_on_rows(node.body, node.inboard, w.bodies[i], at_port, act);
  });
  if (node.parent < 0)
    return;
  const std::size_t inner = node.parent;
  about_z[Space::axis] = -moment;
  w.hinges[i].turn.apply(about_z.data(), at_port.data());
  const int port = node.parent_port - mechanism_.nodes[inner].first_port;
  add_to(inner,
         [&](const auto &act) { put_on_rows(mechanism_.nodes[inner].body, port, w.bodies[inner], at_port, act); });
}

template <class Space> typename NewtonEuler<Space>::Vector NewtonEuler<Space>::loads_along_joint(std::size_t i) const {
  const Node<Space> &node = mechanism_.nodes[i];
  Vector found{};
  for (int k = 0; k < node.shape.freedoms.count; ++k)
    found[node.shape.freedoms.component[k]] += on_coordinates_[node.v + k];
  return found;
}

template <class Space> VectorXd NewtonEuler<Space>::on_body(std::size_t i, const Workspace<Space, double> &w) const {
  const Node<Space> &node = mechanism_.nodes[i];
  const auto &s = w.bodies[i];
  std::vector<Vector> at_ports(on_ports_.begin() + node.first_port,
                               on_ports_.begin() + node.first_port + node.outboard);
  for (std::size_t k = 0; k < mechanism_.nodes.size(); ++k)
    if (const Node<Space> &outer = mechanism_.nodes[k]; outer.parent == static_cast<int>(i)) {
      Vector on_inner = loads_along_joint(k), turned;
      w.hinges[k].turn.add_moment(w.hinges[k].r, on_inner.data());
      w.hinges[k].turn.apply(on_inner.data(), turned.data());
      add(turned, at_ports[outer.parent_port - node.first_port], -1);
    }
  const Vector by_joint = loads_along_joint(i);
  Vector on_frame = by_joint, at_inboard{};
  if (node.inboard >= 0) {
    inboard_tilt(node, s).apply(by_joint.data(), at_inboard.data());
    on_frame = at_inboard;
    to_frame(node.body, node.inboard, s, on_frame);
  }
  for (int k = 0; k < node.outboard; ++k) {
    Vector at_port = at_ports[k];
    to_frame(node.body, k, s, at_port);
    add(at_port, on_frame);
  }
  VectorXd Q(Space::dim + node.n());
  std::copy(on_frame.begin(), on_frame.end(), Q.data());
  const auto on_rows_of_body = [&](const auto &act) {
    for (int k = 0; k < node.outboard; ++k)
      put_on_rows(node.body, k, s, at_ports[k], act);
    if (node.inboard >= 0)
      put_on_rows(node.body, node.inboard, s, at_inboard, act);
    else
      on_tilt(node.body, by_joint, act);
  };
  if (node.n() > 0)
    put_on_modes(node.body, s, on_rows_of_body, Q.data() + Space::dim);
  return Q;
}

template <class Space>
typename NewtonEuler<Space>::ConstraintAcceleration
NewtonEuler<Space>::of_constraint(std::size_t r, const double *a, const Workspace<Space, double> &w) const {
  const Constraint &row = mechanism_.constraints[r];
  const double along_joint = row.node < 0 ? 0 : row.share * a[mechanism_.nodes[row.node].v + row.freedom];
  ConstraintMotion<double> motion;
  constraint_motion(row, w, row.moves, motion);
  double along = 0;
  for (int k = 0; k < Space::linear; ++k)
    along += mechanism_.gravity[k] * motion.force[k];
  const double lift = ((row.a.node < 0) - (row.b.node < 0)) * along;
  ConstraintAcceleration found{along_joint + motion.bias + lift,
                               std::abs(along_joint) + std::abs(motion.bias) + std::abs(lift)};
  for (const auto &actions : mechanism_.actions)
    for (const Action &action : actions.list)
      if (action.constraint == static_cast<int>(r)) {
        const std::size_t port = actions.global_port;
        const Vector x = in_port_axes_of(actions, action, nullptr, w);
        found.value += product(x, ports_[port]);
        for (std::size_t k = 0; k < x.size(); ++k)
          found.size += std::abs(x[k]) * (std::abs(ports_[port][k]) + terms_[port]);
      }
  return found;
}

template class NewtonEuler<Planar>;
template class NewtonEuler<Spatial>;

} // namespace ffrobot::recursion
