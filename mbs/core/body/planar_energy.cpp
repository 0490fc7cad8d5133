// Energies of one body.
#include "core/body/planar_body.h"

#include <cmath>

namespace ffrobot {

using Eigen::Index;
using Eigen::Vector2d;
using Eigen::Vector3d;
using VectorMap = Eigen::Map<const Eigen::VectorXd>;

namespace {

Vector2d perpendicular(const Vector2d &v) { return {-v.y(), v.x()}; }

} // namespace

Energy energy(const PlanarBody &body, const double *q, const double *v, const Vector2d &gravity) {
  const Index n = body.modes();
  const VectorMap p(q + 3, n), p_dot(v + 3, n);
  const double c = std::cos(q[2]), s = std::sin(q[2]), theta_dot = v[2];
  const auto to_body = [&](const Vector2d &u) { return Vector2d(c * u.x() + s * u.y(), -s * u.x() + c * u.y()); };
  const Vector2d R_dot = to_body({v[0], v[1]});
  Vector2d moment = body.first_moment + body.W.topRows<2>() * p;
  Energy e;
  if (body.affine) {
    AffineMotion motion;
    update(body.affine, q + 3, v + 3, motion);
    moment = motion.g.head<2>();
    e.kinetic = kinetic_energy(body.affine, motion, q + 3, v + 3, R_dot, theta_dot);
  } else {
    Vector3d rates = body.W.topRows<3>() * p_dot; // (S_bar, m_thetaf) p_dot
    double inertia = body.inertia + weighted(body, q + 3, q + 3);
    if (body.j.size())
      inertia += 2 * body.j.dot(p);
    if (body.S_tilde.size())
      rates[2] += p.dot(body.S_tilde * p_dot);
    e.kinetic = 0.5 * (body.mass * R_dot.squaredNorm() + inertia * theta_dot * theta_dot + p_dot.squaredNorm()) +
                theta_dot * R_dot.dot(perpendicular(moment)) + R_dot.dot(rates.head<2>()) + theta_dot * rates[2];
  }
  e.strain = 0.5 * p.dot(body.stiffness.cwiseProduct(p));
  e.gravitational = -(body.mass * gravity.dot(Vector2d(q[0], q[1])) + to_body(gravity).dot(moment));
  if (body.damping.cols() == 1)
    e.dissipated_power = p_dot.dot(body.damping.col(0).cwiseProduct(p_dot));
  else if (body.damping.cols() > 1)
    e.dissipated_power = p_dot.dot(body.damping * p_dot);
  return e;
}

} // namespace ffrobot
