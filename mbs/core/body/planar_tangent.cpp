// Derivatives of planar_inverse.cpp: of the force that one body needs for a motion, and of its markers' accelerations.
#include "core/body/planar_tangent.h"

namespace ffrobot {

using Eigen::Index;
using Eigen::Matrix2d;
using Eigen::MatrixXd;
using Eigen::Ref;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;
using VectorMap = Eigen::Map<const VectorXd>;

namespace {

struct Axes {
  explicit Axes(const PlanarBodyState &s) {
    A << s.cosine, -s.sine, s.sine, s.cosine;
    A_theta << -s.sine, -s.cosine, s.cosine, -s.sine;
  }
  Matrix2d A, A_theta;
};

void add_elasticity(const PlanarBody &body, Ref<MatrixXd> D, Ref<MatrixXd> K) {
  const Index n = body.modes();
  K.bottomRightCorner(n, n).diagonal() += body.stiffness;
  if (body.damping.cols() == 1)
    D.bottomRightCorner(n, n).diagonal() += body.damping.col(0);
  else if (body.damping.cols() > 1)
    D.bottomRightCorner(n, n) += body.damping;
}

// With geometric stiffening: from body axes, in which u = A^T (R_ddot - g) and du/dtheta = -u_perp.
void stiffened_tangent(const PlanarBody &body, const PlanarBodyState &s, const double *q, const double *v,
                       const double *a, const Vector2d &gravity, Ref<MatrixXd> M, Ref<MatrixXd> D, Ref<MatrixXd> K) {
  const Index n = body.modes();
  const Axes axes(s);
  const Vector2d u = axes.A.transpose() * (Vector2d(a[0], a[1]) - gravity);
  VectorXd accelerations = VectorMap(a, 3 + n);
  accelerations.head<2>() = u;
  InertiaTangent local;
  const VectorXd f = inertia_force(body.affine, s.affine, q + 3, v + 3, v[2], accelerations, &local);
  MatrixXd to_global = MatrixXd::Identity(3 + n, 3 + n);
  to_global.topLeftCorner<2, 2>() = axes.A;
  M = to_global * local.by_acceleration * to_global.transpose();
  D.leftCols<2>().setZero();
  D.rightCols(1 + n) = to_global * local.by_velocity;
  K.leftCols<2>().setZero();
  K.col(2) = to_global * (local.by_acceleration.leftCols<2>() * Vector2d(u.y(), -u.x()));
  K.block<2, 1>(0, 2) += axes.A_theta * f.head<2>();
  K.rightCols(n) = to_global * local.by_position;
  add_elasticity(body, D, K);
}

} // namespace

// Term by term from the equations above required_force, with J_p = j + m_xy p, half of dm_thetatheta/dp, and
// du/dtheta = -u_perp.
void tangent(const PlanarBody &body, const PlanarBodyState &s, const double *q, const double *v, const double *a,
             const Vector2d &gravity, Ref<MatrixXd> M, Ref<MatrixXd> D, Ref<MatrixXd> K) {
  if (body.affine)
    return stiffened_tangent(body, s, q, v, a, gravity, M, D, K);
  const Index n = body.modes();
  const VectorMap p(q + 3, n), p_dot(v + 3, n), p_ddot(a + 3, n);
  const double theta_dot = v[2], theta_ddot = a[2];
  const Axes axes(s);
  const auto S_bar = s.W.topRows<2>();
  const auto m_thetaf = s.W.row(2);
  const MatrixXd m_ff = body.m_xy.size() ? body.m_xy : MatrixXd(MatrixXd::Identity(n, n));
  VectorXd J_p = m_ff * p;
  double inertia = body.inertia + p.dot(J_p);
  if (body.j.size()) {
    inertia += 2 * body.j.dot(p);
    J_p += body.j;
  }
  const Vector2d moment = body.first_moment + s.displacement.head<2>(), S_p_dot = S_bar * p_dot;
  const Vector2d u = axes.A.transpose() * (Vector2d(a[0], a[1]) - gravity);
  const Vector2d S_p_ddot = S_bar * p_ddot;
  const MatrixXd A_S = axes.A * S_bar, A_theta_S = axes.A_theta * S_bar;

  M.topLeftCorner<2, 2>() = body.mass * Matrix2d::Identity();
  M.block<2, 1>(0, 2) = axes.A_theta * moment;
  M.topRightCorner(2, n) = A_S;
  M(2, 2) = inertia;
  M.block(2, 3, 1, n) = m_thetaf;
  M.block<1, 2>(2, 0) = M.block<2, 1>(0, 2).transpose();
  M.bottomLeftCorner(n, 3) = M.topRightCorner(3, n).transpose();
  M.bottomRightCorner(n, n).setIdentity();

  D.leftCols<2>().setZero();
  D.block<2, 1>(0, 2) = 2 * (axes.A_theta * S_p_dot - theta_dot * (axes.A * moment));
  D(2, 2) = 2 * J_p.dot(p_dot);
  D.block(3, 2, n, 1) = -2 * theta_dot * J_p;
  D.topRightCorner(2, n) = 2 * theta_dot * A_theta_S;
  D.block(2, 3, 1, n) = 2 * theta_dot * J_p.transpose();
  D.bottomRightCorner(n, n).setZero();

  K.leftCols<2>().setZero();
  K.block<2, 1>(0, 2) = -theta_ddot * (axes.A * moment) + axes.A_theta * S_p_ddot -
                        theta_dot * theta_dot * (axes.A_theta * moment) - 2 * theta_dot * (axes.A * S_p_dot);
  K(2, 2) = -moment.dot(u);
  K.block(3, 2, n, 1) = S_bar.transpose() * Vector2d(u.y(), -u.x());
  K.topRightCorner(2, n) = theta_ddot * A_theta_S - theta_dot * theta_dot * A_S;
  K.block(2, 3, 1, n) = (K.block(3, 2, n, 1) + 2 * theta_ddot * J_p + 2 * theta_dot * (m_ff * p_dot)).transpose();
  K.bottomRightCorner(n, n) = -theta_dot * theta_dot * m_ff;
  add_elasticity(body, D, K);

  if (body.S_tilde.size()) {
    const VectorXd S_rate = body.S_tilde * p_dot;
    D.block(3, 2, n, 1) -= 2 * S_rate;
    D.bottomRightCorner(n, n) -= 2 * theta_dot * body.S_tilde;
    K.block(2, 3, 1, n) += (body.S_tilde * p_ddot).transpose();
    K.bottomRightCorner(n, n) -= theta_ddot * body.S_tilde; // m_thetaf = h + p^T S_tilde, S_tilde skew
  }
}

void add_marker_curvature(const PlanarBody &body, const PlanarBodyState &s, Index k, const Vector3d &wrench,
                          Ref<MatrixXd> K) {
  const Index n = body.modes(), row = 3 + 3 * k;
  const Axes axes(s);
  Vector3d f;
  f << axes.A.transpose() * wrench.head<2>(), wrench[2];
  K(2, 2) -= s.markers[static_cast<std::size_t>(k)].arm.dot(wrench.head<2>());
  const VectorXd coupling = s.W.middleRows<2>(row).transpose() * Vector2d(f.y(), -f.x());
  K.block(3, 2, n, 1) += coupling;
  K.block(2, 3, 1, n) += coupling.transpose();
  for (const auto &[r, K_r] : body.second_order)
    if (r >= row && r < row + 3)
      K.bottomRightCorner(n, n) -= f[r - row] * K_r;
}

// acceleration = R_ddot + theta_ddot A_theta u + A Phi(p) p_ddot - theta_dot^2 A u + 2 theta_dot A_theta Phi(p) p_dot
// - A (p_dot^T K p_dot), u = x + Phi p - 1/2 p^T K p, Phi(p) = Phi - p^T K; of the angle likewise.
void marker_tangent(const PlanarBody &body, const PlanarBodyState &s, Index k, const double *v, const double *a,
                    MarkerTangent &result) {
  const Index n = body.modes(), row = 3 + 3 * k;
  const VectorMap p_dot(v + 3, n), p_ddot(a + 3, n);
  const double theta_dot = v[2], theta_ddot = a[2];
  const Axes axes(s);
  const auto Phi = s.W.middleRows<2>(row);
  const Vector2d &arm = s.markers[static_cast<std::size_t>(k)].arm, arm_perp(-arm.y(), arm.x());
  const Index *place = &s.rows.place[static_cast<std::size_t>(row)];
  const Vector2d convective(s.convective[place[0]], s.convective[place[1]]);
  const Vector2d rate = Phi * p_dot, acceleration = Phi * p_ddot - convective;
  const MatrixXd A_Phi = axes.A * Phi, A_theta_Phi = axes.A_theta * Phi;

  auto &[L, V, P] = result;
  L = V = P = Eigen::Matrix3Xd::Zero(3, 3 + n);
  L.leftCols<3>().setIdentity();
  L.block<2, 1>(0, 2) = arm_perp;
  L.topRightCorner(2, n) = A_Phi;
  L.bottomRightCorner(1, n) = s.W.row(row + 2);
  V.block<2, 1>(0, 2) = 2 * (axes.A_theta * rate - theta_dot * arm);
  V.topRightCorner(2, n) = 2 * theta_dot * A_theta_Phi;
  P.block<2, 1>(0, 2) = axes.A_theta * acceleration - theta_ddot * arm - theta_dot * theta_dot * arm_perp -
                        2 * theta_dot * (axes.A * rate);
  P.topRightCorner(2, n) = theta_ddot * A_theta_Phi - theta_dot * theta_dot * A_Phi;
  for (const auto &[r, K_r] : body.second_order) {
    if (r < row || r >= row + 3)
      continue;
    const Index i = r - row;
    const Eigen::RowVectorXd of_rate = (K_r * p_dot).transpose(), of_acceleration = (K_r * p_ddot).transpose();
    Vector3d along = Vector3d::UnitZ(), across = Vector3d::Zero(); // A e_i, A_theta e_i
    if (i < 2) {
      along << axes.A.col(i), 0;
      across << axes.A_theta.col(i), 0;
    }
    V.rightCols(n) -= 2 * along * of_rate;
    P.rightCols(n) -= along * of_acceleration + 2 * theta_dot * across * of_rate;
  }
}

} // namespace ffrobot
