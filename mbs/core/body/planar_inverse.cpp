// Inverse dynamics of one body: the equations of motion read from left to right.
#include "core/body/planar_body.h"

namespace ffrobot {

using Eigen::Index;
using Eigen::Vector2d;
using Eigen::VectorXd;
using VectorMap = Eigen::Map<const VectorXd>;

namespace {

// Takes the applied loads off f, in global axes.
void subtract_loads(const PlanarBody &body, const PlanarBodyState &s, Eigen::Map<VectorXd> f) {
  auto f_f = f.tail(body.modes());
  f_f -= s.modal_load;
  for (Index k = 0; k < body.markers(); ++k) {
    const Vector2d force = s.wrench.col(k).head<2>();
    f.head<2>() -= force;
    f[2] -= perpendicular(s.markers[static_cast<std::size_t>(k)].arm).dot(force) + s.wrench(2, k);
  }
  VectorXd modal = VectorXd::Zero(body.modes());
  add_modal_force(body, s, s.wrench, modal);
  f_f -= modal;
}

} // namespace

// In body axes, with u = A^T (R_ddot - g), W(p) = (S_bar; m_thetaf; ...) (Shabana, Dynamics of Multibody Systems, ch.
// 5; symbols of planar_body.h):
//
//     f_R     = m u + s_perp theta_ddot + S_bar p_ddot - theta_dot^2 s + 2 theta_dot (S_bar p_dot)_perp
//     f_theta = s_perp . u + (J + 2 j p + p m_xy p) theta_ddot + m_thetaf p_ddot + 2 theta_dot (j + p m_xy) p_dot
//     f_f     = S_bar^T u + m_thetaf^T theta_ddot + p_ddot - theta_dot^2 (j + m_xy p) - 2 theta_dot S_tilde p_dot
//               + K p + D p_dot
//
// With geometric stiffening the inertia forces are those of affine_inertia.h.
void required_force(const PlanarBody &body, const double *q, const double *v, const double *a, const Vector2d &gravity,
                    const PlanarBodyState &s, double *f) {
  const Index n = body.modes();
  const VectorMap p(q + 3, n), p_dot(v + 3, n), p_ddot(a + 3, n);
  const double theta_dot = v[2], theta_ddot = a[2];
  Eigen::Matrix2d A;
  A << s.cosine, -s.sine, s.sine, s.cosine;
  const Vector2d u = A.transpose() * (Vector2d(a[0], a[1]) - gravity);
  Vector2d f_R;
  double f_theta = 0;
  Eigen::Map<VectorXd> f_f(f + 3, n);
  if (body.affine) {
    VectorXd of_frame(3 + n);
    of_frame << u, theta_ddot, p_ddot;
    const VectorXd inertia = inertia_force(body.affine, s.affine, q + 3, v + 3, theta_dot, of_frame);
    f_R = inertia.head<2>();
    f_theta = inertia[2];
    f_f = inertia.tail(n) + body.stiffness.cwiseProduct(p);
  } else {
    const auto S_bar = s.W.topRows<2>();
    const auto m_thetaf = s.W.row(2).transpose();
    const Vector2d moment = body.first_moment + s.displacement.head<2>(), S_p_dot = S_bar * p_dot;
    const VectorXd m_p = body.m_xy.size() ? VectorXd(body.m_xy * p) : VectorXd(p);
    f_R = body.mass * u + theta_ddot * perpendicular(moment) + S_bar * p_ddot - theta_dot * theta_dot * moment +
          2 * theta_dot * perpendicular(S_p_dot);
    f_theta = perpendicular(moment).dot(u) + (body.inertia + p.dot(m_p)) * theta_ddot + m_thetaf.dot(p_ddot) +
              2 * theta_dot * m_p.dot(p_dot);
    f_f = S_bar.transpose() * u + theta_ddot * m_thetaf + p_ddot - theta_dot * theta_dot * m_p +
          body.stiffness.cwiseProduct(p);
    if (body.j.size()) {
      f_theta += 2 * body.j.dot(p) * theta_ddot + 2 * theta_dot * body.j.dot(p_dot);
      f_f -= theta_dot * theta_dot * body.j;
    }
    if (body.S_tilde.size())
      f_f -= 2 * theta_dot * (body.S_tilde * p_dot);
  }
  if (body.damping.cols() == 1)
    f_f += body.damping.col(0).cwiseProduct(p_dot);
  else if (body.damping.cols() > 1)
    f_f += body.damping * p_dot;
  const Vector2d f_R_global = A * f_R;
  f[0] = f_R_global.x();
  f[1] = f_R_global.y();
  f[2] = f_theta;
  subtract_loads(body, s, Eigen::Map<VectorXd>(f, 3 + n));
}

} // namespace ffrobot
