#include "core/body/planar_body.h"

#include <algorithm>
#include <cmath>

namespace ffrobot {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using VectorMap = Eigen::Map<const Eigen::VectorXd>;

Vector2d rotate(const PlanarBodyState &s, const Vector2d &v) {
  return {s.cosine * v.x() - s.sine * v.y(), s.sine * v.x() + s.cosine * v.y()};
}

Vector2d rotate_back(const PlanarBodyState &s, const Vector2d &v) {
  return {s.cosine * v.x() + s.sine * v.y(), -s.sine * v.x() + s.cosine * v.y()};
}

// W(p) = W - (K p)^T of markers, and what of W(p) p is second order
void bend(const PlanarBody &body, const VectorMap &p, const VectorMap &p_dot, PlanarBodyState &s) {
  for (const auto &[row, K] : body.second_order) {
    const Eigen::VectorXd K_p = K * p;
    s.W.row(row) = body.W.row(row) - K_p.transpose();
    s.displacement[row] = 0.5 * K_p.dot(p); // what W(p) p has too little
    s.convective[row] = p_dot.dot(K * p_dot);
  }
}

} // namespace

void stiffen(PlanarBody &body, const std::array<MatrixXd, 4> &K) {
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
}

PlanarBodyState::PlanarBodyState(const PlanarBody &body)
    : markers(static_cast<std::size_t>(body.markers())), W(body.W), displacement(Eigen::VectorXd::Zero(body.W.rows())),
      rate(displacement), convective(displacement), wrench(Eigen::Matrix3Xd::Zero(3, body.markers())),
      modal_load(Eigen::VectorXd::Zero(body.modes())) {}

void kinematics(const PlanarBody &body, const double *q, const double *v, PlanarBodyState &s) {
  const VectorMap p(q + 3, body.modes()), p_dot(v + 3, body.modes());
  const double theta = q[2];
  s.cosine = std::cos(theta), s.sine = std::sin(theta), s.theta_dot = v[2];
  s.displacement.setZero();
  bend(body, p, p_dot, s);
  if (body.S_tilde.size())
    s.W.row(2) = body.W.row(2) + p.transpose() * body.S_tilde;
  s.displacement += s.W * p;
  s.rate.noalias() = s.W * p_dot;
  if (body.affine) {
    update(body.affine, q + 3, v + 3, s.affine);
    s.displacement.head<2>() = (s.affine.g - body.affine.N.col(2)).head<2>();
    s.W.topRows<2>() = s.affine.F.topRows<2>();
  }
  const double w = s.theta_dot;
  for (std::size_t k = 0; k < s.markers.size(); ++k) {
    MarkerMotion &m = s.markers[k];
    const auto row = static_cast<Index>(3 + 3 * k);
    const Vector2d at = body.marker_positions[k] + s.displacement.segment<2>(row);
    m.arm = rotate(s, at);
    m.position = Vector2d(q[0], q[1]) + m.arm;
    m.velocity = Vector2d(v[0], v[1]) + rotate(s, s.rate.segment<2>(row) + w * perpendicular(at));
    m.angle = theta + s.displacement[row + 2];
    m.angular_velocity = w + s.rate[row + 2];
  }
}

Vector3d marker_acceleration(const PlanarBody &body, const PlanarBodyState &s, Index k, const double *a) {
  const Index row = 3 + 3 * k;
  const double w = s.theta_dot;
  const Vector3d elastic = s.W.middleRows<3>(row) * VectorMap(a + 3, body.modes()) - s.convective.segment<3>(row);
  const Vector2d &arm = s.markers[static_cast<std::size_t>(k)].arm;
  const Vector2d relative = rotate(s, elastic.head<2>() + 2 * w * perpendicular(s.rate.segment<2>(row)));
  Vector3d found;
  found << Vector2d(a[0], a[1]) + a[2] * perpendicular(arm) - w * w * arm + relative, a[2] + elastic[2];
  return found;
}

void add_modal_force(const PlanarBody &body, const PlanarBodyState &s, const Eigen::Matrix3Xd &wrench,
                     Eigen::Ref<Eigen::VectorXd> modal_force) {
  for (Index k = 0; k < body.markers(); ++k) {
    const Vector2d f = rotate_back(s, wrench.col(k).head<2>());
    modal_force += s.W.middleRows<3>(3 + 3 * k).transpose() * Vector3d(f.x(), f.y(), wrench(2, k));
  }
}

void static_force(const PlanarBody &body, const double *q, const Vector2d &gravity, const PlanarBodyState &s,
                  double *Q) {
  const Index n = body.modes();
  const Vector2d g = rotate_back(s, gravity);
  const Vector2d moment = body.first_moment + s.displacement.head<2>();
  Q[0] = body.mass * gravity.x();
  Q[1] = body.mass * gravity.y();
  Q[2] = perpendicular(moment).dot(g);
  Eigen::Map<Eigen::VectorXd> Q_f(Q + 3, n);
  Q_f = -body.stiffness.cwiseProduct(VectorMap(q + 3, n)) + s.W.topRows<2>().transpose() * g;
  Q_f += s.modal_load;
  for (Index k = 0; k < body.markers(); ++k) {
    Q[0] += s.wrench(0, k);
    Q[1] += s.wrench(1, k);
    Q[2] += perpendicular(s.markers[static_cast<std::size_t>(k)].arm).dot(s.wrench.col(k).head<2>()) + s.wrench(2, k);
  }
  add_modal_force(body, s, s.wrench, Q_f);
}

} // namespace ffrobot
