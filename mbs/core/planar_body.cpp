#include "core/planar_body.h"

#include <algorithm>
#include <cmath>

namespace ffrobot {

namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using VectorMap = Eigen::Map<const Eigen::VectorXd>;

constexpr Index register_width = 4; // doubles: rows of W are padded to a multiple of it

Vector2d perpendicular(const Vector2d &v) { return {-v.y(), v.x()}; }

Vector2d rotate(const PlanarBodyState &s, const Vector2d &v) {
  return {s.cosine * v.x() - s.sine * v.y(), s.sine * v.x() + s.cosine * v.y()};
}

Vector2d rotate_back(const PlanarBodyState &s, const Vector2d &v) {
  return {s.cosine * v.x() + s.sine * v.y(), -s.sine * v.x() + s.cosine * v.y()};
}

// W p, W p_dot and W (K p + D p_dot) in one pass. A row count known to the compiler keeps the sums in registers.
template <int Rows>
void project_fixed(const PlanarBody &body, const double *p, const double *p_dot, PlanarBodyState &s) {
  using Sum = Eigen::Array<double, Rows, 1>;
  Sum Wp = Sum::Zero(), Wp_dot = Sum::Zero(), Wk = Sum::Zero();
  const double *column = s.W_active.data();
  const double *stiffness = body.stiffness.data();
  const double *damping = body.damping.cols() == 1 ? body.damping.data() : nullptr;
  for (Index i = 0; i < body.modes(); ++i, column += Rows) {
    const auto w = Eigen::Map<const Sum>(column);
    double k = stiffness[i] * p[i];
    if (damping)
      k += damping[i] * p_dot[i];
    Wp += w * p[i];
    Wp_dot += w * p_dot[i];
    Wk += w * k;
  }
  for (std::size_t i = 0; i < s.active.size(); ++i) {
    const auto k = static_cast<Index>(i), row = s.active[i];
    s.Wp[row] = Wp[k];
    s.Wp_dot[row] = Wp_dot[k];
    s.Wk[row] = Wk[k];
  }
}

void project(const PlanarBody &body, const double *p, const double *p_dot, PlanarBodyState &s) {
  switch (s.W_active.rows()) {
  case 0:
    s.Wk.setZero();
    return;
  case 4:
    return project_fixed<4>(body, p, p_dot, s);
  case 8:
    return project_fixed<8>(body, p, p_dot, s);
  case 12:
    return project_fixed<12>(body, p, p_dot, s);
  case 16:
    return project_fixed<16>(body, p, p_dot, s);
  }
  const Index n = body.modes();
  s.Wp.noalias() = s.W * VectorMap(p, n);
  s.Wp_dot.noalias() = s.W * VectorMap(p_dot, n);
  s.Wk.setZero();
  for (Index i = 0; i < n; ++i)
    s.Wk += s.W.col(i) * (body.stiffness[i] * p[i] + (body.damping.cols() == 1 ? body.damping(i, 0) * p_dot[i] : 0.0));
}

void update_gram(Index row, PlanarBodyState &s) {
  s.W_transposed.col(row) = s.W.row(row).transpose();
  const auto k = std::find(s.active.begin(), s.active.end(), row) - s.active.begin();
  s.W_active.row(k) = s.W.row(row);
  s.W_active_transposed.col(k) = s.W.row(row).transpose();
  s.G.row(row).noalias() = s.W.row(row) * s.W_transposed;
  s.G.col(row) = s.G.row(row).transpose();
}

// m_thetaf = h + p^T S_tilde replaces the row h of W where S_tilde is not zero.
void update_rotation_row(const PlanarBody &body, const double *p, PlanarBodyState &s) {
  s.W.row(2).noalias() = body.W.row(2) + VectorMap(p, body.modes()).transpose() * body.S_tilde;
  update_gram(2, s);
}

// L D L^T of the 3 x 3 mass matrix of the frame, p eliminated. Its translational block m I - S_bar S_bar^T is constant
// without geometric stiffening.
void factorise_translation(double mass, PlanarBodyState &s) {
  s.D_inverse[0] = 1 / (mass - s.G(0, 0));
  s.L[0] = -s.G(1, 0) * s.D_inverse[0];
  s.D_inverse[1] = 1 / (mass - s.G(1, 1) + s.L[0] * s.G(1, 0));
}

// W(p) = W - (K p)^T; after update_rotation_row, which writes row 2 anew.
void update_second_order(const PlanarBody &body, const double *p, const double *p_dot, PlanarBodyState &s) {
  const Index n = body.modes();
  const VectorMap p_(p, n), p_dot_(p_dot, n);
  s.displacement.setZero();
  for (const auto &[row, K] : body.second_order) {
    s.curvature.noalias() = K * p_;
    if (row != 2 || body.S_tilde.size() == 0)
      s.W.row(row) = body.W.row(row);
    s.W.row(row) -= s.curvature.transpose();
    s.displacement[row] = 0.5 * s.curvature.dot(p_); // what W(p) p has too little
    s.curvature.noalias() = K * p_dot_;
    s.convective[row] = s.curvature.dot(p_dot_);
  }
  for (const auto &second : body.second_order)
    update_gram(second.row, s);
  factorise_translation(body.mass, s);
}

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
    s.W_extra.noalias() = s.W * s.extra;
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

// p^T m_xy q
double weighted(const PlanarBody &body, const double *p, const double *q) {
  const Index n = body.modes();
  const VectorMap p_(p, n);
  if (body.m_xy.size() == 0)
    return p_.dot(VectorMap(q, n));
  double sum = 0;
  for (Index i = 0; i < n; ++i)
    sum += body.m_xy.col(i).dot(p_) * q[i];
  return sum;
}

// Block (k, l) of the mobility, Z D^-1 Z^T + (Phi_k Phi_l^T in global axes), and its mirror.
void add_mobility(const PlanarBody &body, Index k, Index l, PlanarBodyState &s) {
  const double *g0 = s.G.data() + (3 + 3 * l) * s.padded_rows + 3 + 3 * k;
  const double *g1 = g0 + s.padded_rows, *g2 = g1 + s.padded_rows;
  const double c = s.cosine, sn = s.sine;
  const double g00 = c * g0[0] - sn * g0[1], g10 = sn * g0[0] + c * g0[1]; // A Phi_k Phi_l^T
  const double g01 = c * g1[0] - sn * g1[1], g11 = sn * g1[0] + c * g1[1];
  Matrix3d E = Matrix3d::Zero();
  E(0, 0) = c * g00 - sn * g01;
  E(1, 0) = c * g10 - sn * g11;
  E(0, 1) = sn * g00 + c * g01;
  E(1, 1) = sn * g10 + c * g11;
  const int rows = body.marker_rows[static_cast<std::size_t>(k)],
            columns = body.marker_rows[static_cast<std::size_t>(l)];
  if (columns == 3) {
    E(0, 2) = c * g2[0] - sn * g2[1];
    E(1, 2) = sn * g2[0] + c * g2[1];
  }
  if (rows == 3) {
    E(2, 0) = c * g0[2] - sn * g1[2];
    E(2, 1) = sn * g0[2] + c * g1[2];
    E(2, 2) = g2[2];
  }
  for (int j = 0; j < columns; ++j) {
    const Vector3d z = s.Z_transposed.col(3 * l + j).cwiseProduct(s.D_inverse);
    for (int i = 0; i < rows; ++i)
      E(i, j) += s.Z_transposed.col(3 * k + i).dot(z);
  }
  s.mobility.block<3, 3>(3 * k, 3 * l) = E;
  if (l != k)
    s.mobility.block<3, 3>(3 * l, 3 * k) = E.transpose();
}

// out += W^T z over the rows that carry anything
void accumulate_rows(const PlanarBodyState &s, const Eigen::VectorXd &z, Index n, double *out) {
  const std::size_t count = s.active.size();
  const auto factor = [&](std::size_t i) { return i < count ? z[s.active[i]] : 0.0; };
  for (std::size_t i = 0; i < count; i += register_width) {
    const double *w0 = s.W_active_transposed.data() + static_cast<Index>(i) * n, *w1 = w0 + n, *w2 = w1 + n,
                 *w3 = w2 + n;
    const double z0 = factor(i), z1 = factor(i + 1), z2 = factor(i + 2), z3 = factor(i + 3);
    for (Index k = 0; k < n; ++k)
      out[k] += z0 * w0[k] + z1 * w1[k] + z2 * w2[k] + z3 * w3[k];
  }
}

} // namespace

PlanarBodyState::PlanarBodyState(const PlanarBody &body) : markers(static_cast<std::size_t>(body.markers())) {
  const Index n = body.modes(), rows = body.W.rows();
  padded_rows = (rows + register_width - 1) / register_width * register_width;
  W = Eigen::MatrixXd::Zero(padded_rows, n);
  W.topRows(rows) = body.W;
  W_transposed = W.transpose();
  G = W * W_transposed;
  for (Index row = 0; row < rows; ++row) {
    const bool moves = std::any_of(body.second_order.begin(), body.second_order.end(),
                                   [&](const SecondOrder &second) { return second.row == row; });
    if (moves || (row == 2 && body.S_tilde.size()) || !body.W.row(row).isZero(0))
      active.push_back(row);
  }
  const auto count = static_cast<Index>(active.size());
  W_active = Eigen::MatrixXd::Zero((count + register_width - 1) / register_width * register_width, n);
  for (Index i = 0; i < count; ++i)
    W_active.row(i) = W.row(active[static_cast<std::size_t>(i)]);
  W_active_transposed = W_active.transpose();
  for (auto *v : {&Wp, &Wp_dot, &Wk, &W_extra, &z, &z_response, &displacement, &convective})
    *v = Eigen::VectorXd::Zero(padded_rows);
  extra = modal_load = curvature = Eigen::VectorXd::Zero(n);
  wrench = free_acceleration = Eigen::Matrix3Xd::Zero(3, body.markers());
  Z_transposed = Eigen::Matrix3Xd::Zero(3, 3 * body.markers());
  mobility = Eigen::MatrixXd::Zero(3 * body.markers(), 3 * body.markers());
  factorise_translation(body.mass, *this);
}

void kinematics(const PlanarBody &body, const double *q, const double *v, PlanarBodyState &s) {
  s.cosine = std::cos(q[2]);
  s.sine = std::sin(q[2]);
  s.theta_dot = v[2];
  if (body.S_tilde.size())
    update_rotation_row(body, q + 3, s);
  if (!body.second_order.empty())
    update_second_order(body, q + 3, v + 3, s);
  project(body, q + 3, v + 3, s);
  if (body.second_order.empty())
    s.displacement = s.Wp;
  else
    s.displacement += s.Wp;
  const Vector2d R(q[0], q[1]), R_dot(v[0], v[1]);
  for (std::size_t k = 0; k < s.markers.size(); ++k) {
    auto &m = s.markers[k];
    const double *u = s.displacement.data() + 3 + 3 * k, *u_dot = s.Wp_dot.data() + 3 + 3 * k;
    const Vector2d arm = body.marker_positions[k] + Vector2d(u[0], u[1]);
    m.arm = rotate(s, arm);
    m.position = R + m.arm;
    m.velocity = R_dot + rotate(s, s.theta_dot * perpendicular(arm) + Vector2d(u_dot[0], u_dot[1]));
    m.angle = q[2] + u[2];
    m.angular_velocity = s.theta_dot + u_dot[2];
  }
}

namespace {

// Forces on the frame: (Q_R in body axes, Q_theta) of inertia and gravity.
Vector3d frame_force(const PlanarBody &body, const double *p, const double *p_dot, const Vector2d &g,
                     const Vector2d &moment, const PlanarBodyState &s) {
  const double theta_dot = s.theta_dot;
  Vector3d Q;
  Q.head<2>() = body.mass * g + theta_dot * theta_dot * moment - 2 * theta_dot * perpendicular(s.Wp_dot.head<2>());
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
    const Vector2d f = s.wrench.col(k).head<2>();
    s.z.segment<2>(3 + 3 * k) = rotate_back(s, f);
    s.z[5 + 3 * k] = s.wrench(2, k);
    Q.head<2>() += s.z.segment<2>(3 + 3 * k);
    Q[2] += perpendicular(s.markers[static_cast<std::size_t>(k)].arm).dot(f) + s.wrench(2, k);
  }
}

// Acceleration of marker k = B (a, alpha) + Phi_k p_ddot + velocity terms, with p_ddot from its eliminated rows.
void eliminate_marker(const PlanarBody &body, Index k, const Eigen::VectorXd &WQ, PlanarBodyState &s) {
  const Index row = 3 + 3 * k;
  const Vector2d arm = rotate_back(s, s.markers[static_cast<std::size_t>(k)].arm);
  Matrix3d B = -s.G.block<3, 3>(row, 0);
  B(0, 0) += 1;
  B(1, 1) += 1;
  B(0, 2) -= arm.y();
  B(1, 2) += arm.x();
  B(2, 2) += 1;
  Vector3d a = B * s.free_frame + WQ.segment<3>(row);
  if (!body.second_order.empty())
    a -= s.convective.segment<3>(row);
  a.head<2>() += -s.theta_dot * s.theta_dot * arm + 2 * s.theta_dot * perpendicular(s.Wp_dot.segment<2>(row));
  const Vector2d a_global = rotate(s, a.head<2>());
  s.free_acceleration.col(k) << a_global, a[2];
  for (int c = 0; c < 3; ++c) {
    const double x = B(0, c), y = B(1, c);
    B(0, c) = s.cosine * x - s.sine * y;
    B(1, c) = s.sine * x + s.cosine * y;
  }
  for (int r = 0; r < body.marker_rows[static_cast<std::size_t>(k)]; ++r)
    s.Z_transposed.col(3 * k + r) = forward(s.L, B.row(r).transpose());
}

} // namespace

void free_motion(const PlanarBody &body, const double *q, const double *v, const Vector2d &gravity,
                 PlanarBodyState &s) {
  const double *p = q + 3, *p_dot = v + 3;
  const Vector2d g = rotate_back(s, gravity);
  const Vector2d moment = s.moment = body.first_moment + s.displacement.head<2>();
  Vector3d Q = frame_force(body, p, p_dot, g, moment, s);

  // Known part of the modal forces: Q_f = theta_dot^2 p - K p - D p_dot + W^T z + extra
  s.z.setZero();
  s.z.head<2>() = g;
  auto &WQ = s.Wk; // W Q_f, in place of W (K p + D p_dot)
  WQ = s.theta_dot * s.theta_dot * s.Wp - s.Wk + s.G.col(0) * g.x() + s.G.col(1) * g.y();
  if (s.has_wrench) {
    add_wrenches(body, Q, s);
    WQ.noalias() += s.G.rightCols(s.padded_rows - 3) * s.z.tail(s.padded_rows - 3);
  }
  if (collect_extra(body, p, p_dot, s))
    WQ += s.W_extra;
  else
    s.extra.setZero();

  // The frame after elimination of p
  const Vector2d coupling = perpendicular(moment) - s.G.col(2).head<2>();
  s.inertia = body.inertia + weighted(body, p, p);
  if (body.j.size())
    s.inertia += 2 * body.j.dot(VectorMap(p, body.modes()));
  if (body.K_omega.size())
    s.inertia -= VectorMap(p, body.modes()).dot(body.K_omega * VectorMap(p, body.modes()));
  factorise_rotation(coupling, s.inertia - s.G(2, 2), s);
  s.free_frame = backward(s.L, forward(s.L, Q - WQ.head<3>()).cwiseProduct(s.D_inverse));

  for (Index k = 0; k < body.markers(); ++k)
    eliminate_marker(body, k, WQ, s);
  for (Index k = 0; k < body.markers(); ++k)
    for (Index l = 0; l <= k; ++l)
      add_mobility(body, k, l, s);
}

namespace {

// (a, alpha) in body axes caused by wrenches on the markers, and the rows of W^T they load.
Vector3d frame_response(const PlanarBody &body, const Eigen::Matrix3Xd &wrench, PlanarBodyState &s,
                        Eigen::VectorXd &z) {
  Vector3d b = Vector3d::Zero();
  for (Index k = 0; k < body.markers(); ++k) {
    const auto f = wrench.col(k);
    b += s.Z_transposed.middleCols<3>(3 * k) * f;
    z[3 + 3 * k] = s.cosine * f[0] + s.sine * f[1];
    z[4 + 3 * k] = -s.sine * f[0] + s.cosine * f[1];
    z[5 + 3 * k] = f[2];
  }
  const Vector3d x = backward(s.L, b.cwiseProduct(s.D_inverse));
  z.head<3>() = -x;
  return x;
}

} // namespace

void accelerations(const PlanarBody &body, const double *q, const double *v, const Eigen::Matrix3Xd &constraint_wrench,
                   PlanarBodyState &s, double *a) {
  const Index n = body.modes();
  const Vector3d x = s.free_frame + frame_response(body, constraint_wrench, s, s.z_response);
  s.z_response += s.z;
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
  accumulate_rows(s, s.z_response, n, p_ddot);
}

Vector3d marker_acceleration(const PlanarBody &body, const PlanarBodyState &s, Index k, const double *q,
                             const double *a, double &size) {
  const Index row = 3 + 3 * k;
  const Vector3d Phi_p_ddot = s.W.middleRows<3>(row) * VectorMap(a + 3, body.modes()) - s.convective.segment<3>(row);
  const Vector2d &arm = s.markers[static_cast<std::size_t>(k)].arm;
  const Vector2d elastic = rotate(s, Phi_p_ddot.head<2>());
  const Vector2d coriolis = rotate(s, 2 * s.theta_dot * perpendicular(s.Wp_dot.segment<2>(row)));
  const Vector2d frame = Vector2d(a[0], a[1]), turn = a[2] * perpendicular(arm);
  const Vector2d centripetal = -s.theta_dot * s.theta_dot * arm;
  const Vector3d elastic_force = s.W.middleRows<3>(row) * body.stiffness.cwiseProduct(VectorMap(q + 3, body.modes()));
  size = elastic_force.norm() + frame.norm() + turn.norm() + centripetal.norm() + coriolis.norm() + elastic.norm() +
         std::abs(a[2]) + std::abs(Phi_p_ddot[2]);
  Vector3d acceleration;
  acceleration << frame + turn + centripetal + coriolis + elastic, a[2] + Phi_p_ddot[2];
  return acceleration;
}

void respond(const PlanarBody &body, const Eigen::Matrix3Xd &wrench, PlanarBodyState &s, double *dq) {
  const Vector3d x = frame_response(body, wrench, s, s.z_response);
  const Vector2d dR = rotate(s, x.head<2>());
  dq[0] = dR.x();
  dq[1] = dR.y();
  dq[2] = x[2];
  std::fill(dq + 3, dq + 3 + body.modes(), 0.0);
  accumulate_rows(s, s.z_response, body.modes(), dq + 3);
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

Energy energy(const PlanarBody &body, const double *q, const double *v, const Vector2d &gravity) {
  const Index n = body.modes();
  const VectorMap p(q + 3, n), p_dot(v + 3, n);
  const double c = std::cos(q[2]), s = std::sin(q[2]), theta_dot = v[2];
  const auto to_body = [&](const Vector2d &u) { return Vector2d(c * u.x() + s * u.y(), -s * u.x() + c * u.y()); };
  const Vector2d R_dot = to_body({v[0], v[1]});
  Vector2d moment = body.first_moment + body.W.topRows<2>() * p;
  Vector3d rates = body.W.topRows<3>() * p_dot; // (S_bar, m_thetaf) p_dot
  double inertia = body.inertia + weighted(body, q + 3, q + 3);
  if (body.j.size())
    inertia += 2 * body.j.dot(p);
  if (body.S_tilde.size())
    rates[2] += p.dot(body.S_tilde * p_dot);
  if (body.K_omega.size())
    inertia -= p.dot(body.K_omega * p);
  for (const auto &[row, K] : body.second_order) {
    if (row < 2)
      moment[row] -= 0.5 * p.dot(K * p);
    if (row < 3)
      rates[row] -= p.dot(K * p_dot);
  }
  Energy e;
  e.kinetic = 0.5 * (body.mass * R_dot.squaredNorm() + inertia * theta_dot * theta_dot + p_dot.squaredNorm()) +
              theta_dot * R_dot.dot(perpendicular(moment)) + R_dot.dot(rates.head<2>()) + theta_dot * rates[2];
  e.strain = 0.5 * p.dot(body.stiffness.cwiseProduct(p));
  e.gravitational = -(body.mass * gravity.dot(Vector2d(q[0], q[1])) + to_body(gravity).dot(moment));
  if (body.damping.cols() == 1)
    e.dissipated_power = p_dot.dot(body.damping.col(0).cwiseProduct(p_dot));
  else if (body.damping.cols() > 1)
    e.dissipated_power = p_dot.dot(body.damping * p_dot);
  return e;
}

} // namespace ffrobot
