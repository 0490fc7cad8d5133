#include "core/body/planar_body.h"

#include "core/body/lanes.h"
#include "core/body/moving_rows.h"

#include <algorithm>
#include <cmath>

namespace ffrobot {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
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
  if (body.j.size() && !body.affine) {
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
  if (body.damping.cols() > 1) {
    start();
    s.extra.noalias() -= body.damping * VectorMap(p_dot, n);
  }
  if (any)
    s.W_extra.noalias() = s.rows.W * s.extra;
  return any;
}

// coupling: between translation and rotation of the frame
void factorise_rotation(double coupling_x, double coupling_y, double inertia, PlanarBodyState &s) {
  const double y = coupling_y - s.L[0] * coupling_x;
  s.L[1] = coupling_x * s.D_inverse[0];
  s.L[2] = y * s.D_inverse[1];
  s.D_inverse[2] = 1 / (inertia - s.L[1] * coupling_x - s.L[2] * y);
}

// Coefficient by coefficient: what has just been written one by one is slow to load as a vector.
Vector3d forward(const Vector3d &L, Vector3d b) {
  b[1] -= L[0] * b[0];
  b[2] -= L[1] * b[0] + L[2] * b[1];
  return b;
}

Vector3d backward(const PlanarBodyState &s, Vector3d b) {
  b[2] *= s.D_inverse[2];
  b[1] = b[1] * s.D_inverse[1] - s.L[2] * b[2];
  b[0] = b[0] * s.D_inverse[0] - s.L[0] * b[1] - s.L[1] * b[2];
  return b;
}

} // namespace

void stiffen(PlanarBody &body, const std::array<Eigen::MatrixXd, 4> &K) {
  if (std::all_of(K.begin(), K.end(), [](const auto &one) { return one.size() == 0; }))
    return;
  const Index n = body.modes();
  Matrix4Xd F = Matrix4Xd::Zero(4, n); // S_bar, j, h
  F.topRows<2>() = body.W.topRows<2>();
  F.row(3) = body.W.row(2);
  if (body.j.size())
    F.row(2) = body.j.transpose();
  const MatrixXd none = MatrixXd::Zero(n, n), one = MatrixXd::Identity(n, n);
  body.affine = AffineInertia(body.mass, body.first_moment, body.inertia, F, body.m_xy.size() ? body.m_xy : one,
                              body.S_tilde.size() ? body.S_tilde : none, K);
  body.W.conservativeResize(body.affine_row() + body.affine.row_count(), n);
  body.affine.rows(F, body.W.bottomRows(body.affine.row_count()));
}

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
  for (auto *v : {&W_extra, &z, &none, &z_response, &displacement, &convective})
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
  for (Index i = 0; i < s.rows.rows(); i += lane_count) {
    const Lanes u = load(s.rows.Wp.data() + i);
    store(s.displacement.data() + i, body.is_stiffened() ? u + load(s.displacement.data() + i) : u);
  }
  const double c = s.cosine, sn = s.sine, w = s.theta_dot;
  for (std::size_t k = 0; k < s.markers.size(); ++k) {
    auto &m = s.markers[k];
    const Index *place = s.rows.place.data() + 3 + 3 * k;
    const double *u = s.displacement.data(), *u_dot = s.rows.Wp_dot.data();
    const double x = body.marker_positions[k].x() + u[place[0]], y = body.marker_positions[k].y() + u[place[1]];
    const double x_dot = u_dot[place[0]] - w * y, y_dot = u_dot[place[1]] + w * x;
    m.arm = {c * x - sn * y, sn * x + c * y};
    m.position = {q[0] + m.arm.x(), q[1] + m.arm.y()};
    m.velocity = {v[0] + c * x_dot - sn * y_dot, v[1] + sn * x_dot + c * y_dot};
    m.angle = theta + u[place[2]];
    m.angular_velocity = w + u_dot[place[2]];
  }
}

namespace {

// Forces on the frame: (Q_R in body axes, Q_theta) of inertia and gravity (g, body axes); those on affine rows go to z.
Vector3d frame_force(const PlanarBody &body, const double *p, const double *p_dot, const Vector2d &g,
                     PlanarBodyState &s) {
  const double w = s.theta_dot;
  const Eigen::VectorXd &Wp_dot = s.rows.Wp_dot;
  Vector3d Q;
  Q[0] = body.mass * g[0] + w * w * s.moment[0] + 2 * w * Wp_dot[1];
  Q[1] = body.mass * g[1] + w * w * s.moment[1] - 2 * w * Wp_dot[0];
  Q[2] = s.moment[0] * g[1] - s.moment[1] * g[0];
  Q[2] -= 2 * w * (body.m_xy.size() ? weighted(body, p, p_dot) : s.rows.p_p_dot);
  if (body.affine) {
    Q.head<2>() += s.convective.head<2>();
    Q[2] += velocity_force(body.affine, s.affine, w, s.z.data() + s.rows.affine);
  } else if (body.j.size()) {
    Q[2] -= 2 * w * body.j.dot(VectorMap(p_dot, body.modes()));
  }
  return Q;
}

// W Q_f of the modal forces Q_f = theta_dot^2 p - K p - D p_dot + S_bar^T g, in place of W (K p + D p_dot)
void project_modal_force(const Vector2d &g, PlanarBodyState &s) {
  const PackedRows &rows = s.rows;
  const double *G = rows.G.data(), w_2 = s.theta_dot * s.theta_dot;
  for (Index i = 0; i < rows.rows(); i += lane_count) {
    double *Wk = s.rows.Wk.data() + i;
    store(Wk, w_2 * load(rows.Wp.data() + i) - load(Wk) + g[0] * load(G + i) + g[1] * load(G + rows.rows() + i));
  }
}

// m_ff of affine rows: the force of these on the accelerations that the modes have as if it were the identity.
void add_affine_inertia(const PlanarBody &body, PlanarBodyState &s) {
  const Index first = s.rows.affine, rank = body.affine.rank();
  Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 8, 1> U_c =
      s.theta_dot * s.theta_dot * s.rows.Wp.segment(first, rank) - s.rows.Wk.segment(first, rank);
  if (s.has_extra)
    U_c += s.W_extra.segment(first, rank);
  s.z.segment(first, rank) -= body.affine.C * U_c;
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
  s.gravity = rotate_back(s, gravity);
  s.moment[0] = body.first_moment[0] + s.displacement[0];
  s.moment[1] = body.first_moment[1] + s.displacement[1];
  s.has_load = s.has_wrench || body.affine;
  if (s.has_load)
    s.z.setZero();
  Vector3d Q = frame_force(body, p, p_dot, s.gravity, s);
  s.has_extra = collect_extra(body, p, p_dot, s);
  if (body.affine)
    add_affine_inertia(body, s);
  project_modal_force(s.gravity, s);
  Eigen::VectorXd &WQ = rows.Wk;
  if (s.has_wrench)
    add_wrenches(body, Q, s);
  if (s.has_load)
    WQ.noalias() += rows.G * s.z;
  if (s.has_extra)
    WQ += s.W_extra;

  // The frame after elimination of p
  const Index n = body.modes();
  const double p_m_xy_p = body.m_xy.size() ? weighted(body, p, p) : rows.p_p;
  s.inertia = body.affine ? rotary_inertia(body.affine, s.affine, p_m_xy_p) : body.inertia + p_m_xy_p;
  if (body.j.size() && !body.affine)
    s.inertia += 2 * body.j.dot(VectorMap(p, n));
  factorise_rotation(-s.moment[1] - rows.G(0, 2), s.moment[0] - rows.G(1, 2), s.inertia - rows.G(2, 2), s);
  s.free_frame = backward(s, forward(s.L, {Q[0] - WQ[0], Q[1] - WQ[1], Q[2] - WQ[2]}));
  eliminate_ports(WQ, s);
  update_mobility(s);
}

namespace {

// (a, alpha) in body axes caused by the forces on the ports, and the multipliers of packed rows that they change: those
// of ports are written, applied loads with them.
Vector3d frame_response(PlanarBodyState &s, const Eigen::VectorXd &z_applied) {
  const PackedRows &rows = s.rows;
  const double *Z = s.Z.data(), *f = s.port_force.data();
  Vector3d b(0, 0, 0);
  if (s.has_load)
    s.z_response = z_applied; // else only ports and the frame carry anything
  for (Index i = 0; i < rows.ports; ++i) {
    b[0] += f[i] * Z[i];
    b[1] += f[i] * Z[i + rows.ports];
    b[2] += f[i] * Z[i + 2 * rows.ports];
  }
  for (Index i = 0; i < rows.ports; i += 2) {
    const bool translation = rows.is_translation[i] != 0;
    const double c = translation ? s.cosine : 1, sn = translation ? s.sine : 0;
    s.z_response[first_port + i] = z_applied[first_port + i] + c * f[i] + sn * f[i + 1];
    s.z_response[first_port + i + 1] = z_applied[first_port + i + 1] + c * f[i + 1] - sn * f[i];
  }
  return backward(s, b);
}

} // namespace

void accelerations(const PlanarBody &body, const double *q, PlanarBodyState &s, double *a) {
  const Index n = body.modes();
  Vector3d x = frame_response(s, s.z);
  for (int i = 0; i < 3; ++i)
    x[i] += s.free_frame[i];
  s.z_response[0] = s.gravity[0] - x[0];
  s.z_response[1] = s.gravity[1] - x[1];
  s.z_response[2] = -x[2];
  if (body.affine)
    s.rows.apply_inertia(body.affine.C, s.z_response);
  a[0] = s.cosine * x[0] - s.sine * x[1];
  a[1] = s.sine * x[0] + s.cosine * x[1];
  a[2] = x[2];
  s.rows.combine(s.z_response);
  const double w_2 = s.theta_dot * s.theta_dot;
  const double *p = q + 3, *elastic = s.rows.elastic_force.data(), *W_z = s.rows.W_transposed_z.data();
  double *p_ddot = a + 3;
  Index i = 0;
  for (; i + lane_count <= n; i += lane_count)
    store(p_ddot + i, w_2 * load(p + i) - load(elastic + i) + load(W_z + i));
  for (; i < n; ++i)
    p_ddot[i] = w_2 * p[i] - elastic[i] + W_z[i];
  if (s.has_extra)
    Eigen::Map<Eigen::VectorXd>(p_ddot, n) += s.extra;
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

void apply_inverse_mass(const PlanarBody &body, PlanarBodyState &s, double *dq) {
  const Vector3d x = frame_response(s, s.none);
  for (int i = 0; i < 3; ++i)
    s.z_response[i] = -x[i];
  dq[0] = s.cosine * x[0] - s.sine * x[1];
  dq[1] = s.sine * x[0] + s.cosine * x[1];
  dq[2] = x[2];
  if (body.affine)
    s.rows.apply_inertia(body.affine.C, s.z_response);
  s.rows.combine(s.z_response);
  std::copy_n(s.rows.W_transposed_z.data(), body.modes(), dq + 3);
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
