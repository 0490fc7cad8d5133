#include "core/recursion/mechanism/mechanism.h"

#include "core/check_index.h"

#include <Eigen/Geometry>

namespace ffrobot::recursion {

namespace {

[[noreturn]] void refuse(const std::string &text) { throw std::invalid_argument(text); }

// Of the modes at a marker, rows along its own axes
MatrixXd section_rows(const PlanarMarker &marker) {
  MatrixXd rows = marker.Phi;
  rows.topRows<2>() = Eigen::Rotation2D<double>(-marker.angle).toRotationMatrix() * marker.Phi.topRows<2>();
  return rows;
}
MatrixXd section_rows(const SpatialMarker &marker) {
  MatrixXd rows = marker.Phi;
  rows.topRows<3>() = marker.triad.transpose() * marker.Phi.topRows<3>();
  rows.bottomRows<3>() = marker.triad.transpose() * marker.Phi.bottomRows<3>();
  return rows;
}

// Whether they have terms of second order along one of them
bool is_curved(const PlanarData &data, const PlanarMarker &marker, int row) {
  return planar::is_curved(data, marker, row);
}
bool is_curved(const SpatialData &data, const SpatialMarker &marker, int row) {
  const std::vector<MatrixXd> K = spatial::section_K(marker);
  return !K.empty() && K[row].cwiseAbs().maxCoeff() > spatial::negligible_K(data);
}

PlanarData at_marker(const PlanarData &data, const PlanarMarker &m) { return planar::moved(data, m.position, m.angle); }
SpatialData at_marker(const SpatialData &data, const SpatialMarker &m) {
  return spatial::moved(data, m.position, m.triad);
}

// Of the body's data, where its frame is at a marker: in axes of that
Matrix3d axes_from(const PlanarMarker &m) {
  Matrix3d axes = Matrix3d::Identity();
  axes.topLeftCorner<2, 2>() = Eigen::Rotation2D<double>(-m.angle).toRotationMatrix();
  return axes;
}
Matrix3d axes_from(const SpatialMarker &m) { return m.triad.transpose(); }

// Whether a frame fixed at the inboard marker is where the joint holds the section: modes move the section at most in
// ways that the joint leaves free, and nothing asks for the joint's coordinate.
template <class Space>
bool frame_sits_at_joint(const BodyModel<typename Space::Data> &body, const JointShape &shape, bool asked) {
  if (body.data.modes() == 0)
    return true;
  const auto &marker = body.data.markers[body.inboard_marker];
  const MatrixXd rows = section_rows(marker);
  for (int c = 0; c < Space::dim; ++c) {
    const int *first = shape.freedoms.component;
    const bool is_free = std::find(first, first + shape.freedoms.count, c) != first + shape.freedoms.count;
    // The free axis of a universal joint on the inner side is none of the section's.
    const bool counts = !is_free || asked || (body.joint == JointKind::universal && c == 3) ||
                        (body.joint == JointKind::screw && c == 5); // turns and slides together
    const double scale = 1 / std::sqrt(std::max(body.data.mass, 1e-300));
    if (counts && (rows.row(c).cwiseAbs().maxCoeff() > 1e-12 * scale || is_curved(body.data, marker, c)))
      return false;
  }
  return true;
}

// `count` matrices over the modes
void check_K(const std::string &name, const char *key, const std::vector<MatrixXd> &all, std::size_t count, Index n) {
  bool fits = all.size() == count;
  for (const MatrixXd &K : all)
    fits = fits && K.rows() == n && K.cols() == n;
  if (!fits)
    refuse(name + ": " + key + ": expected " + std::to_string(count) + " matrices (" + std::to_string(n) + ", " +
           std::to_string(n) + ")");
}

void check_stiffening(const std::string &name, const PlanarData &data) {
  const bool stiffened = data.is_stiffened();
  check_K(name, "K", data.K, stiffened ? 4 : 0, data.modes());
  for (const PlanarMarker &marker : data.markers)
    check_K(name, "K of a marker", marker.K, stiffened && !marker.K.empty() ? 3 : 0, data.modes());
}
void check_stiffening(const std::string &name, const SpatialData &data) {
  const bool stiffened = data.is_stiffened();
  check_K(name, "K_s", data.K_s, stiffened ? 3 : 0, data.modes());
  check_K(name, "K_x", data.K_x, stiffened ? 9 : 0, data.modes());
  for (const SpatialMarker &marker : data.markers)
    check_K(name, "K of a marker", marker.K, stiffened && !marker.K.empty() ? 6 : 0, data.modes());
}

template <class Data>
void check(const BodyModel<Data> &body, std::size_t index, std::size_t ground_markers,
           const std::vector<BodyModel<Data>> &bodies, int dim) {
  const std::string name = "body " + body.name;
  if (body.parent < -1 || body.parent >= static_cast<int>(index))
    refuse(name + ": parent: expected -1 (ground) or a body before it, got " + std::to_string(body.parent));
  const std::size_t there = body.parent < 0 ? ground_markers : bodies[body.parent].data.markers.size();
  check_index(name + ": parent_marker", body.parent_marker, there);
  check_index(name + ": inboard_marker", body.inboard_marker, body.data.markers.size());
  for (const auto &marker : body.data.markers)
    if (body.data.modes() && (marker.Phi.rows() != dim || marker.Phi.cols() != body.data.modes()))
      refuse(name + ": Phi of a marker: expected (" + std::to_string(dim) + ", " + std::to_string(body.data.modes()) +
             ")");
  check_stiffening(name, body.data);
  if (body.rotor_inertia > 0 && body.joint != JointKind::revolute && body.joint != JointKind::prismatic)
    refuse(name + ": rotor_inertia: expected a revolute or prismatic joint under a rotor");
}

bool is_weightless(const PlanarData &data) { return data.mass == 0 && data.inertia == 0 && data.modes() == 0; }
bool is_weightless(const SpatialData &data) {
  return data.mass == 0 && data.J2.isZero(0) && data.J_spin == 0 && data.modes() == 0;
}

bool turns(const PlanarMarker &) { return false; }
bool turns(const SpatialMarker &marker) { return marker.turns; }

} // namespace

// What the phases of the constructor hand on to each other, body by body.
template <class Space> struct Mechanism<Space>::Plan {
  std::vector<BodyModel<Data>> bodies;
  std::vector<std::vector<int>> markers;    // that are outboard ports; the inboard port is added last
  std::vector<char> carries, passes_moment; // another body; a moment at one of its ports
};

template <class Space>
Mechanism<Space>::Mechanism(std::vector<BodyModel<Data>> bodies, std::vector<Marker> ground_,
                            std::vector<ConstraintModel> models, std::vector<MarkerAt> loaded, const VectorXd &gravity_)
    : ground(std::move(ground_)), gravity(gravity_) {
  check_size("gravity", gravity.size(), Space::linear);
  const std::size_t count = bodies.size();
  nodes.resize(count);
  Plan plan{std::move(bodies), std::vector<std::vector<int>>(count), std::vector<char>(count),
            std::vector<char>(count)};
  take_tree(plan);
  attach_constraints(models, plan);
  for (const MarkerAt &at : loaded)
    wrenches.push_back(attach(at, plan));
  find_passed_moments(loaded, plan);
  for (std::size_t i = 0; i < count; ++i)
    take_body(nodes[i], plan);
  check_coordinates();
  connect_ports();
  for (Constraint &constraint : constraints)
    classify(constraint);
  collect_actions();
  if constexpr (std::is_same_v<Space, Planar>)
    connect_pins();
}

// Parents, with an outboard port for each child
template <class Space> void Mechanism<Space>::take_tree(Plan &plan) {
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const BodyModel<Data> &body = plan.bodies[i];
    check(body, i, ground.size(), plan.bodies, Space::dim);
    Node<Space> &node = nodes[i];
    node.index = static_cast<int>(i), node.parent = body.parent, node.parent_port = body.parent_marker;
    if (body.parent < 0) {
      if (turns(ground[body.parent_marker]))
        refuse("body " + body.name + ": parent_marker: expected one that stands still, got one that turns");
      continue;
    }
    const std::size_t parent = body.parent;
    plan.carries[parent] = 1;
    node.parent_port = static_cast<int>(plan.markers[parent].size());
    plan.markers[parent].push_back(body.parent_marker);
  }
}

// A port for each marker of constraint equations and wrenches where there is none yet
template <class Space> Attachment Mechanism<Space>::attach(const MarkerAt &at, Plan &plan) const {
  if (at.body < 0) {
    check_index("ground marker", at.marker, ground.size());
    return {-1, at.marker, -1};
  }
  if (at.body >= static_cast<int>(plan.markers.size()))
    refuse("marker: expected a body below " + std::to_string(plan.markers.size()) + ", got " + std::to_string(at.body));
  auto &ports = plan.markers[at.body];
  const auto found = std::find(ports.begin(), ports.end(), at.marker);
  const int port = found - ports.begin();
  if (found == ports.end())
    ports.push_back(at.marker);
  return {at.body, port, -1};
}

template <class Space>
void Mechanism<Space>::attach_constraints(const std::vector<ConstraintModel> &models, Plan &plan) {
  const auto follows = [&](const Attachment &at) { return at.node < 0 && turns(ground[at.port]); };
  for (const ConstraintModel &model : models) {
    if (model.coordinate >= 0 && (model.kind == ConstraintKind::point || model.kind == ConstraintKind::dot))
      refuse("row " + model.name + ": coordinate: expected one of an angle or slide, got one of another kind of row");
    Constraint constraint{model, {}, {}, -1, 0};
    if (model.kind != ConstraintKind::coordinate) {
      constraint.a = attach(model.a, plan), constraint.b = attach(model.b, plan);
      constraint.follows = follows(constraint.a) || follows(constraint.b);
    }
    constraints.push_back(constraint);
  }
}

// Moments pass to joints that do more than turn, to driven ones, and by constraint equations and wrenches.
template <class Space> void Mechanism<Space>::find_passed_moments(const std::vector<MarkerAt> &loaded, Plan &plan) {
  int first = 0; // in v
  for (BodyModel<Data> &body : plan.bodies) {
    const int end = first + Space::shape(body.joint).freedoms.count;
    const bool is_constrained = std::ranges::any_of(
        constraints, [&](const Constraint &of) { return of.model.coordinate >= first && of.model.coordinate < end; });
    body.driven = body.driven || is_constrained;
    first = end + static_cast<int>(body.data.modes());
    if (body.parent >= 0 && (body.joint != JointKind::revolute || is_constrained || body.rotor_inertia > 0))
      plan.passes_moment[body.parent] = 1;
  }
  const auto pass_at = [&](const Attachment &at) {
    if (at.node >= 0)
      plan.passes_moment[at.node] = 1;
  };
  for (const Constraint &constraint : constraints)
    if (constraint.model.kind != ConstraintKind::point)
      pass_at(constraint.a), pass_at(constraint.b);
  for (std::size_t k = 0; k < wrenches.size(); ++k)
    if (!loaded[k].only_forces)
      pass_at(wrenches[k]);
}

// A joint and its body: where its frame sits, its coordinates, ports and places for columns
template <class Space> void Mechanism<Space>::take_body(Node<Space> &node, Plan &plan) {
  const std::size_t i = node.index;
  BodyModel<Data> &model = plan.bodies[i];
  node.name = model.name, node.joint = model.joint, node.is_driven = model.driven;
  node.shape = Space::shape(model.joint);
  node.lead = model.lead, node.rotor_inertia = model.rotor_inertia, node.gear_ratio = model.gear_ratio;
  node.rotor_turns = model.joint == JointKind::revolute ? 1 : 0;
  node.q = n_q, node.v = n_v;
  node.modes_q = n_q + node.shape.q_count(), node.modes_v = n_v + node.shape.freedoms.count;
  for (Constraint &of : constraints)
    if (of.model.coordinate >= n_v && of.model.coordinate < n_v + node.shape.freedoms.count) {
      of.node = node.index, of.freedom = of.model.coordinate - n_v;
      of.share = of.model.kind == ConstraintKind::coordinate ? 1 : -1;
      node.has_constraints = true;
    }
  place_frame(node, plan);
  node.is_weightless = is_weightless(model.data) && node.outboard == 0;
  if (is_weightless(model.data) && (node.rotor_inertia <= 0 || node.outboard > 0))
    refuse("body " + model.name + ": mass: expected one above 0 of a body that is more than the output of a rotor");
  node.first_port = ports, ports += node.ports();
  const int n_ports = node.ports();
  node.first_cross = crosses, crosses += n_ports * (n_ports - 1) / 2;
  node.is_single_grounded =
      node.parent < 0 && !plan.carries[i] && !node.is_weightless && node.shape.freedoms.count < Space::dim;
  node.first_slot = slots, node.port_slots = node.inboard_slot() + (node.inboard >= 0 ? 2 * Space::dim : 0);
  slots = node.ground_slot() + (node.is_single_grounded ? Space::dim : 0);
  if (node.shape.quaternion >= 0)
    rotations.push_back(n_v + node.shape.freedoms.count - 3);
  n_q += node.shape.q_count() + node.n(), n_v += node.shape.freedoms.count + node.n();
}

// At the joint, where modes do not move the section there (a pin's may turn it), else where the body's data have it
template <class Space> void Mechanism<Space>::place_frame(Node<Space> &node, Plan &plan) {
  const std::size_t i = node.index;
  BodyModel<Data> &model = plan.bodies[i];
  std::vector<int> &markers = plan.markers[i];
  const bool asked = model.driven || model.of_section || model.rotor_inertia > 0;
  const bool sits = frame_sits_at_joint<Space>(model, node.shape, asked);
  const Marker inboard = model.data.markers[model.inboard_marker];
  node.outboard = static_cast<int>(markers.size());
  node.markers = markers, node.markers.push_back(model.inboard_marker);
  bool tilts = false; // modes turn the section, and nothing but that
  if constexpr (std::is_same_v<Space, Planar>) {
    node.is_pin = node.joint == JointKind::revolute && node.rotor_inertia == 0 && node.outboard <= 1 &&
                  !plan.passes_moment[i] && frame_sits_at_joint<Space>(model, node.shape, false) &&
                  !is_curved(model.data, inboard, Space::axis);
    tilts = node.is_pin && !sits;
  }
  if (sits || tilts) {
    model.data = at_marker(model.data, inboard), node.axes = axes_from(inboard);
    node.origin = -(node.axes.leftCols(inboard.position.size()) * inboard.position);
  } else
    node.inboard = node.outboard, markers.push_back(model.inboard_marker);
  if constexpr (std::is_same_v<Space, Planar>)
    node.body = planar::Body(model.data, markers, tilts ? model.inboard_marker : -1);
  else
    node.body = spatial::Body(model.data, markers);
}

template <class Space> void Mechanism<Space>::check_coordinates() const {
  for (const Constraint &of : constraints) {
    if (of.node >= 0 && nodes[of.node].shape.in_inner_axes)
      refuse("row " + of.model.name + ": expected a coordinate of a joint with rotations or one slide, got one of a " +
             "planar or free joint: use rows between markers");
    if ((of.model.kind == ConstraintKind::coordinate || of.model.coordinate >= 0) && of.node < 0)
      refuse("row " + of.model.name + ": expected a joint coordinate, got " + std::to_string(of.model.coordinate) +
             " of " + std::to_string(n_v) + " velocities");
  }
}

// Numbers of ports among all of the mechanism: inboard ports of joints, what a constraint equation or wrench acts on
template <class Space> void Mechanism<Space>::connect_ports() {
  children.assign(ports, -1);
  cleared.assign(ports, 0);
  for (Node<Space> &node : nodes)
    if (node.parent >= 0) {
      node.parent_port += nodes[node.parent].first_port;
      children[node.parent_port] = node.index;
    }
  const auto connect = [&](Attachment &at) {
    if (at.node < 0)
      return;
    at.global_port = nodes[at.node].first_port + at.port;
    cleared[at.global_port] = 1;
  };
  for (Constraint &of : constraints)
    if (of.model.kind != ConstraintKind::coordinate)
      connect(of.a), connect(of.b);
  for (Attachment &at : wrenches)
    connect(at);
  for (std::size_t port = 0; port < children.size(); ++port)
    if (children[port] < 0)
      cleared[port] = 1;
}

// What an evaluation has to know of its direction
template <class Space> void Mechanism<Space>::classify(Constraint &of) {
  const ConstraintKind kind = of.model.kind;
  if (kind == ConstraintKind::coordinate)
    return;
  of.moves = kind != ConstraintKind::point && kind != ConstraintKind::rotation;
  if (kind == ConstraintKind::point)
    of.lift = gravity.dot(of.model.f.head(Space::linear)) * ((of.a.node < 0) - (of.b.node < 0));
  needs_positions = needs_positions || of.moves;
  has_moving_constraints = has_moving_constraints || of.moves || of.follows;
}

// What constraint equations and wrenches do, port by port
template <class Space> void Mechanism<Space>::collect_actions() {
  for (const Node<Space> &node : nodes)
    for (int k = 0; k < node.outboard; ++k) {
      const int port = node.first_port + k;
      if (!cleared[port])
        continue;
      Actions found{node.index, k, port, {}, false, false};
      for (std::size_t r = 0; r < constraints.size(); ++r)
        for (const double sign : {1., -1.})
          if (const Constraint &of = constraints[r]; (sign > 0 ? of.b : of.a).global_port == port) {
            const Vector3d f = sign * of.model.f;
            const bool is_point = of.model.kind == ConstraintKind::point;
            found.list.push_back({static_cast<int>(r), -1, sign, is_point, {f[0], f[1], f[2]}});
          }
      for (std::size_t number = 0; number < wrenches.size(); ++number)
        if (wrenches[number].global_port == port)
          found.list.push_back({-1, static_cast<int>(number), -1, false, {}});
      for (const Action &action : found.list)
        (action.is_point ? found.has_points : found.has_others) = true;
      actions.push_back(found);
    }
}

// What the recursion in the plane would look up in other nodes at every evaluation
template <class Space> void Mechanism<Space>::connect_pins() {
  for (Node<Space> &node : nodes) {
    if (node.joint == JointKind::revolute || node.joint == JointKind::planar)
      node.angle = node.joint == JointKind::planar ? node.q + 2 : node.q;
    const int child = node.outboard ? children[node.first_port] : -1;
    node.is_loaded = child >= 0;
    node.carries_pin = child >= 0 && nodes[child].is_pin;
    if (node.is_pin && child >= 0 && nodes[child].is_driven)
      node.moment_on_port = nodes[child].v;
    node.parent_is_pin = node.is_pin;
    if (node.parent < 0) {
      if constexpr (std::is_same_v<Space, Planar>)
        node.inner_angle = ground[node.parent_port].angle;
      continue;
    }
    const Node<Space> &parent = nodes[node.parent];
    node.parent_is_pin = node.is_pin && parent.is_pin;
    node.adds_up = cleared[node.parent_port];
    if constexpr (std::is_same_v<Space, Planar>) {
      const planar::Port &port = parent.body.ports[node.parent_port - parent.first_port];
      node.inner_angle = port.angle, node.inner_rotation = port.row + 2;
    }
  }
}

template struct Mechanism<Planar>;
template struct Mechanism<Spatial>;

} // namespace ffrobot::recursion
