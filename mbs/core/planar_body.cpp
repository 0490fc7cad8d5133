#include "core/planar_body.h"

#include "core/lanes.h"
#include "core/moving_rows.h"

#include <cmath>

namespace ffrobot {

namespace {

using Eigen::Index;
using Eigen::Vector2d;
using Eigen::Vector3d;
using VectorMap = Eigen::Map<const Eigen::VectorXd>;

constexpr Index first_port = PackedRows::first_port;

Vector2d perpendicular(const Vector2d &v) { return {-v.y(), v.x()}; }

Vector2d rotate(const PlanarBodyState &s, const Vector2d &v) {
  return {s.cosine * v.x() - s.sine * v.y(), s.sine * v.x() + s.cosine * v.y()};
}

Vector2d rotate_back(const PlanarBodyState &s, const Vector2d &v) {
  return {s.cosine * v.x() + s.sine * v.y(), -s.sine * v.x() + s.cosine * v.y()};
}

// A turn of lanes: pairs (x, y) of translations, rotations as they are.
struct Turn {
  Turn(const PackedRows &rows, Index i, double c, double s)
      : cosine(load(rows.is_rotation.data() + i) + c * load(rows.is_translation.data() + i)),
        sine(s * load(rows.turn.data() + i)) {}
  Lanes operator()(Lanes v) const { return cosine * v + sine * swap_pairs(v); }

  Lanes cosine, sine;
};

// Modal forces that the common case (mass-orthonormal planar modes, diagonal damping, no modal load) has not.
bool collect_extra(const PlanarBody &body, const double *p, const double *p_dot, PlanarBodyState &s) {
  const Index n = body.modes();
  const double theta_dot_squared = s.theta_dot * s.theta_dot;
  bool any = false;
  const auto start = [&] {
    if (!any)
      s.extra.setZero();
    any = true;
  };
  if (s.has_modal_load) {
    start();
    s.extra += s.modal_load;
  }
  if (body.j.size()) {
    start();
    s.extra += theta_dot_squared * body.j;
  }
  if (body.S_tilde.size()) {
    start();
    s.extra.noalias() += (2 * s.theta_dot) * (body.S_tilde * VectorMap(p_dot, n));
  }
  if (body.m_xy.size()) { // theta_dot^2 p is in the common case already
    start();
    s.extra.noalias() += theta_dot_squared * (body.m_xy * VectorMap(p, n));
    s.extra -= theta_dot_squared * VectorMap(p, n);
  }
  if (body.K_omega.size()) {
    start();
    s.extra.noalias() -= theta_dot_squared * (body.K_omega * VectorMap(p, n));
  }
  if (body.damping.cols() > 1) {
    start();
    s.extra.noalias() -= body.damping * VectorMap(p_dot, n);
  }
  if (any)
    s.W_extra.noalias() = s.rows.W * s.extra;
  return any;
}

void factorise_rotation(const Vector2d &coupling, double inertia, PlanarBodyState &s) {
  const double y = coupling.y() - s.L[0] * coupling.x();
  s.L[1] = coupling.x() * s.D_inverse[0];
  s.L[2] = y * s.D_inverse[1];
  s.D_inverse[2] = 1 / (inertia - s.L[1] * coupling.x() - s.L[2] * y);
}

Vector3d forward(const Vector3d &L, Vector3d b) {
  b[1] -= L[0] * b[0];
  b[2] -= L[1] * b[0] + L[2] * b[1];
  return b;
}

Vector3d backward(const Vector3d &L, Vector3d b) {
  b[1] -= L[2] * b[2];
  b[0] -= L[0] * b[1] + L[1] * b[2];
  return b;
}

} // namespace

double weighted(const PlanarBody &body, const double *p, const double *x) {
  const Index n = body.modes();
  const VectorMap p_(p, n);
  if (body.m_xy.size() == 0)
    return p_.dot(VectorMap(x, n));
  double sum = 0;
  for (Index i = 0; i < n; ++i)
    sum += body.m_xy.col(i).dot(p_) * x[i];
  return sum;
}

PlanarBodyState::PlanarBodyState(const PlanarBody &body)
    : markers(static_cast<std::size_t>(body.markers())), W(body.W), rows(body) {
  for (auto *v : {&W_extra, &z, &z_response, &displacement, &convective})
    *v = Eigen::VectorXd::Zero(rows.rows());
  extra = modal_load = curvature = Eigen::VectorXd::Zero(body.modes());
  wrench = Eigen::Matrix3Xd::Zero(3, body.markers());
  port_acceleration = port_force = Eigen::VectorXd::Zero(rows.ports);
  Z = Eigen::MatrixXd::Zero(rows.ports, 3);
  mobility = Eigen::MatrixXd::Zero(rows.ports, rows.ports);
  factorise_translation(body.mass, *this);
}

void kinematics(const PlanarBody &body, const double *q, const double *v, PlanarBodyState &s) {
  const double theta = q[2]; // one call of sincos
  s.cosine = std::cos(theta);
  s.sine = std::sin(theta);
  s.theta_dot = v[2];
  update_moving_rows(body, q + 3, v + 3, s);
  s.rows.project(body, q + 3, v + 3);
  if (body.second_order.empty())
    s.displacement = s.rows.Wp;
  else
    s.displacement += s.rows.Wp;
  const Vector2d R(q[0], q[1]), R_dot(v[0], v[1]);
  for (std::size_t k = 0; k < s.markers.size(); ++k) {
    auto &m = s.markers[k];
    const Index *place = s.rows.place.data() + 3 + 3 * k;
    const Vector2d u(s.displacement[place[0]], s.displacement[place[1]]);
    const Vector2d u_dot(s.rows.Wp_dot[place[0]], s.rows.Wp_dot[place[1]]);
    const Vector2d arm = body.marker_positions[k] + u;
    m.arm = rotate(s, arm);
    m.position = R + m.arm;
    m.velocity = R_dot + rotate(s, s.theta_dot * perpendicular(arm) + u_dot);
    m.angle = theta + s.displacement[place[2]];
    m.angular_velocity = s.theta_dot + s.rows.Wp_dot[place[2]];
  }
}

namespace {

// Forces on the frame: (Q_R in body axes, Q_theta) of inertia and gravity.
Vector3d frame_force(const PlanarBody &body, const double *p, const double *p_dot, const Vector2d &g,
                     const Vector2d &moment, const PlanarBodyState &s) {
  const double theta_dot = s.theta_dot;
  Vector3d Q;
  Q.head<2>() = body.mass * g + theta_dot * theta_dot * moment - 2 * theta_dot * perpendicular(s.rows.Wp_dot.head<2>());
  Q[2] = -2 * theta_dot * weighted(body, p, p_dot) + perpendicular(moment).dot(g);
  if (!body.second_order.empty())
    Q += s.convective.head<3>();
  if (body.K_omega.size())
    Q[2] += 2 * theta_dot * VectorMap(p, body.modes()).dot(body.K_omega * VectorMap(p_dot, body.modes()));
  if (body.j.size())
    Q[2] -= 2 * theta_dot * body.j.dot(VectorMap(p_dot, body.modes()));
  return Q;
}

// Adds the applied wrenches to the force on the frame, and to z in body axes.
void add_wrenches(const PlanarBody &body, Vector3d &Q, PlanarBodyState &s) {
  for (Index k = 0; k < body.markers(); ++k) {
    const Index *place = s.rows.place.data() + 3 + 3 * k;
    const Vector2d f = s.wrench.col(k).head<2>(), f_body = rotate_back(s, f);
    s.z[place[0]] += f_body.x();
    s.z[place[1]] += f_body.y();
    s.z[place[2]] += s.wrench(2, k);
    Q.head<2>() += f_body;
    Q[2] += perpendicular(s.markers[static_cast<std::size_t>(k)].arm).dot(f) + s.wrench(2, k);
  }
}

// Port acceleration = B (a, alpha) + Phi p_ddot + velocity terms, with p_ddot from its eliminated rows.
void eliminate_ports(const Eigen::VectorXd &WQ, PlanarBodyState &s) {
  const PackedRows &rows = s.rows;
  const double w = s.theta_dot, *G = rows.G.data();
  for (Index i = 0; i < rows.ports; i += lane_count) {
    const Index row = first_port + i;
    const Turn turn(rows, i, s.cosine, s.sine);
    const Lanes quarter = load(rows.turn.data() + i), is_translation = load(rows.is_translation.data() + i);
    const Lanes arm = is_translation * (load(rows.position.data() + i) + load(s.displacement.data() + row));
    const Lanes Wp_dot = load(rows.Wp_dot.data() + row);
    const Lanes B0 = load(rows.along_x.data() + i) - load(G + row);
    const Lanes B1 = load(rows.along_y.data() + i) - load(G + rows.rows() + row);
    const Lanes B2 = load(rows.is_rotation.data() + i) + quarter * swap_pairs(arm) - load(G + 2 * rows.rows() + row);
    const Lanes a = s.free_frame[0] * B0 + s.free_frame[1] * B1 + s.free_frame[2] * B2 + load(WQ.data() + row) -
                    load(s.convective.data() + row) - (w * w) * arm + (2 * w) * (quarter * swap_pairs(Wp_dot));
    store(s.port_acceleration.data() + i, turn(a));
    const Lanes Z0 = turn(B0), Z1 = turn(B1) - s.L[0] * Z0, Z2 = turn(B2) - s.L[1] * Z0 - s.L[2] * Z1;
    store(s.Z.data() + i, Z0);
    store(s.Z.data() + rows.ports + i, Z1);
    store(s.Z.data() + 2 * rows.ports + i, Z2);
  }
}

// Z D^-1 Z^T + (Phi Phi^T in global axes)
void update_mobility(PlanarBodyState &s) {
  const PackedRows &rows = s.rows;
  const Index ports = rows.ports;
  const double *Z0 = s.Z.data(), *Z1 = Z0 + ports, *Z2 = Z1 + ports;
  for (Index i = 0; i < ports; i += lane_count) {
    const Turn turn(rows, i, s.cosine, s.sine);
    const Lanes z0 = s.D_inverse[0] * load(Z0 + i), z1 = s.D_inverse[1] * load(Z1 + i),
                z2 = s.D_inverse[2] * load(Z2 + i);
    const auto column = [&](Index j, Lanes Phi_Phi) {
      store(s.mobility.data() + j * ports + i, turn(Phi_Phi) + Z0[j] * z0 + Z1[j] * z1 + Z2[j] * z2);
    };
    const double *G = rows.G.data() + first_port * rows.rows() + first_port + i;
    for (Index j = 0; j < i + lane_count; j += 2) {
      const Lanes x = load(G + j * rows.rows()), y = load(G + (j + 1) * rows.rows());
      if (rows.is_translation[j] != 0) {
        column(j, s.cosine * x - s.sine * y);
        column(j + 1, s.sine * x + s.cosine * y);
      } else {
        column(j, x);
        column(j + 1, y);
      }
    }
  }
}

} // namespace

void free_motion(const PlanarBody &body, const double *q, const double *v, const Vector2d &gravity,
                 PlanarBodyState &s) {
  const double *p = q + 3, *p_dot = v + 3;
  PackedRows &rows = s.rows;
  const Vector2d g = rotate_back(s, gravity);
  const Vector2d moment = s.moment = body.first_moment + s.displacement.head<2>();
  Vector3d Q = frame_force(body, p, p_dot, g, moment, s);

  // Known part of the modal forces: Q_f = theta_dot^2 p - K p - D p_dot + W^T z + extra
  auto &WQ = rows.Wk; // W Q_f, in place of W (K p + D p_dot)
  WQ = s.theta_dot * s.theta_dot * rows.Wp - rows.Wk + rows.G.col(0) * g.x() + rows.G.col(1) * g.y();
  s.z.setZero();
  if (s.has_wrench) {
    add_wrenches(body, Q, s);
    WQ.noalias() += rows.G * s.z;
  }
  s.z.head<2>() += g;
  if (collect_extra(body, p, p_dot, s))
    WQ += s.W_extra;
  else
    s.extra.setZero();

  // The frame after elimination of p
  const Vector2d coupling = perpendicular(moment) - rows.G.col(2).head<2>();
  s.inertia = body.inertia + weighted(body, p, p);
  if (body.j.size())
    s.inertia += 2 * body.j.dot(VectorMap(p, body.modes()));
  if (body.K_omega.size())
    s.inertia -= VectorMap(p, body.modes()).dot(body.K_omega * VectorMap(p, body.modes()));
  factorise_rotation(coupling, s.inertia - rows.G(2, 2), s);
  s.free_frame = backward(s.L, forward(s.L, Q - WQ.head<3>()).cwiseProduct(s.D_inverse));

  eliminate_ports(WQ, s);
  update_mobility(s);
}

namespace {

// (a, alpha) in body axes caused by the forces on the ports; adds the rows of W^T they load to z.
Vector3d frame_response(PlanarBodyState &s, Eigen::VectorXd &z) {
  const Index ports = s.rows.ports;
  Lanes b0{}, b1{}, b2{};
  for (Index i = 0; i < ports; i += lane_count) {
    const Lanes f = load(s.port_force.data() + i);
    b0 += f * load(s.Z.data() + i);
    b1 += f * load(s.Z.data() + ports + i);
    b2 += f * load(s.Z.data() + 2 * ports + i);
    double *z_ports = z.data() + first_port + i;
    store(z_ports, load(z_ports) + Turn(s.rows, i, s.cosine, -s.sine)(f));
  }
  const Vector3d x = backward(s.L, Vector3d(sum(b0), sum(b1), sum(b2)).cwiseProduct(s.D_inverse));
  z.head<3>() -= x;
  return x;
}

} // namespace

void accelerations(const PlanarBody &body, const double *q, const double *v, PlanarBodyState &s, double *a) {
  const Index n = body.modes();
  s.z_response = s.z;
  const Vector3d x = s.free_frame + frame_response(s, s.z_response);
  s.z_response.head<3>() -= s.free_frame;
  const Vector2d R_ddot = rotate(s, x.head<2>());
  a[0] = R_ddot.x();
  a[1] = R_ddot.y();
  a[2] = x[2];
  const double theta_dot_squared = s.theta_dot * s.theta_dot;
  const double *p = q + 3, *p_dot = v + 3, *stiffness = body.stiffness.data(), *extra = s.extra.data();
  double *p_ddot = a + 3;
  for (Index i = 0; i < n; ++i)
    p_ddot[i] = (theta_dot_squared - stiffness[i]) * p[i] + extra[i];
  if (body.damping.cols() == 1)
    for (Index i = 0; i < n; ++i)
      p_ddot[i] -= body.damping(i, 0) * p_dot[i];
  s.rows.accumulate(s.z_response, p_ddot);
}

Vector3d marker_acceleration(const PlanarBody &body, const PlanarBodyState &s, Index k, const double *q,
                             const double *a, double &size) {
  const Index row = 3 + 3 * k, *place = s.rows.place.data() + row;
  const Vector3d convective(s.convective[place[0]], s.convective[place[1]], s.convective[place[2]]);
  const Vector3d Phi_p_ddot = s.W.middleRows<3>(row) * VectorMap(a + 3, body.modes()) - convective;
  const Vector2d &arm = s.markers[static_cast<std::size_t>(k)].arm;
  const Vector2d elastic = rotate(s, Phi_p_ddot.head<2>());
  const Vector2d coriolis =
      rotate(s, 2 * s.theta_dot * perpendicular({s.rows.Wp_dot[place[0]], s.rows.Wp_dot[place[1]]}));
  const Vector2d frame = Vector2d(a[0], a[1]), turn = a[2] * perpendicular(arm);
  const Vector2d centripetal = -s.theta_dot * s.theta_dot * arm;
  const Vector3d elastic_force = s.W.middleRows<3>(row) * body.stiffness.cwiseProduct(VectorMap(q + 3, body.modes()));
  size = elastic_force.norm() + frame.norm() + turn.norm() + centripetal.norm() + coriolis.norm() + elastic.norm() +
         std::abs(a[2]) + std::abs(Phi_p_ddot[2]);
  Vector3d acceleration;
  acceleration << frame + turn + centripetal + coriolis + elastic, a[2] + Phi_p_ddot[2];
  return acceleration;
}

void respond(const PlanarBody &body, PlanarBodyState &s, double *dq) {
  s.z_response.setZero();
  const Vector3d x = frame_response(s, s.z_response);
  const Vector2d dR = rotate(s, x.head<2>());
  dq[0] = dR.x();
  dq[1] = dR.y();
  dq[2] = x[2];
  std::fill(dq + 3, dq + 3 + body.modes(), 0.0);
  s.rows.accumulate(s.z_response, dq + 3);
}

void add_modal_force(const PlanarBody &body, const PlanarBodyState &s, const Eigen::Matrix3Xd &wrench,
                     Eigen::Ref<Eigen::VectorXd> modal_force) {
  for (Index k = 0; k < body.markers(); ++k) {
    const Vector2d f = rotate_back(s, wrench.col(k).head<2>());
    modal_force += s.W.middleRows<3>(3 + 3 * k).transpose() * Vector3d(f.x(), f.y(), wrench(2, k));
  }
}

void static_force(const PlanarBody &body, const double *q, const Vector2d &gravity, PlanarBodyState &s, double *Q) {
  const Index n = body.modes();
  const Vector2d g = rotate_back(s, gravity);
  const Vector2d moment = body.first_moment + s.displacement.head<2>();
  Q[0] = body.mass * gravity.x();
  Q[1] = body.mass * gravity.y();
  Q[2] = perpendicular(moment).dot(g);
  Eigen::Map<Eigen::VectorXd> Q_f(Q + 3, n);
  Q_f = -body.stiffness.cwiseProduct(VectorMap(q + 3, n)) + s.W.topRows<2>().transpose() * g;
  if (s.has_modal_load)
    Q_f += s.modal_load;
  if (s.has_wrench) {
    for (Index k = 0; k < body.markers(); ++k) {
      Q[0] += s.wrench(0, k);
      Q[1] += s.wrench(1, k);
      Q[2] += perpendicular(s.markers[static_cast<std::size_t>(k)].arm).dot(s.wrench.col(k).head<2>()) + s.wrench(2, k);
    }
    add_modal_force(body, s, s.wrench, Q_f);
  }
}

} // namespace ffrobot
