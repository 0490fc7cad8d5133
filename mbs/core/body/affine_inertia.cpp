#include "core/body/affine_inertia.h"

#include <Eigen/LU>

namespace ffrobot {

using Eigen::Index;
using Eigen::Matrix4d;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector4d;
using Eigen::VectorXd;
using VectorMap = Eigen::Map<const VectorXd>;

namespace {

template <class Rows> auto quarter_turn(const Rows &x) {
  Eigen::Matrix<double, 4, Rows::ColsAtCompileTime> turned(4, x.cols());
  turned << -x.row(1), x.row(0), -x.row(3), x.row(2);
  return turned;
}

Matrix4d mass_of_affine_fields(double m, const Vector2d &s, double J) {
  Matrix4d N;
  N << m, 0, s[0], -s[1], 0, m, s[1], s[0], s[0], s[1], J, 0, -s[1], s[0], 0, J;
  return N;
}

} // namespace

AffineInertia::AffineInertia(double mass, const Vector2d &first_moment, double J, const Matrix4Xd &F_,
                             const MatrixXd &m_xy, const MatrixXd &S_tilde, const std::array<MatrixXd, 4> &K_)
    : N(mass_of_affine_fields(mass, first_moment, J)), N_inverse(N.inverse()), F(F_), K(K_) {
  const MatrixXd affine = F.transpose() * N_inverse * F;
  m_xy_rest = m_xy - affine;
  m_ff_rest = MatrixXd::Identity(modes(), modes()) - affine;
  S_tilde_rest = S_tilde - quarter_turn(F).transpose() * N_inverse * F;
}

void update(const AffineInertia &inertia, const double *p, const double *p_dot, AffineMotion &motion) {
  const Index n = inertia.modes();
  const VectorMap p_(p, n), p_dot_(p_dot, n);
  motion.g = inertia.N.col(2) + inertia.F * p_;
  motion.g_dot = inertia.F * p_dot_;
  motion.curvature.setZero();
  motion.F = inertia.F;
  for (Index i = 0; i < 4; ++i) {
    const MatrixXd &K = inertia.K[static_cast<std::size_t>(i)];
    if (K.size() == 0)
      continue;
    motion.K_p.noalias() = K * p_;
    motion.F.row(i) -= motion.K_p.transpose();
    motion.g[i] -= 0.5 * p_.dot(motion.K_p);
    motion.g_dot[i] -= p_dot_.dot(motion.K_p);
    motion.K_p.noalias() = K * p_dot_;
    motion.curvature[i] = p_dot_.dot(motion.K_p);
  }
}

// f = X^T N^-1 gamma + that of the rest, gamma = X a - theta_dot^2 g + 2 i theta_dot g_dot - p_dot^T K p_dot
VectorXd inertia_force(const AffineInertia &inertia, const AffineMotion &motion, const double *p, const double *p_dot,
                       double w, const VectorXd &a) {
  const Index n = inertia.modes();
  const VectorMap p_(p, n), p_dot_(p_dot, n), p_ddot(a.data() + 3, n);
  const MatrixXd &m_rest = inertia.m_xy_rest, &S_rest = inertia.S_tilde_rest;
  const double theta_ddot = a[2];
  Matrix4Xd X(4, 3 + n);
  X << inertia.N.leftCols<2>(), quarter_turn(motion.g), motion.F;
  const Vector4d gamma = X * a - w * w * motion.g + 2 * w * quarter_turn(motion.g_dot) - motion.curvature;
  const Vector4d y = inertia.N_inverse * gamma;
  const VectorXd m_p = m_rest * p_, S_p_ddot = S_rest * p_ddot;

  VectorXd f = X.transpose() * y;
  f[2] += theta_ddot * m_p.dot(p_) + 2 * w * m_p.dot(p_dot_) + p_.dot(S_p_ddot);
  f.tail(n) += inertia.m_ff_rest * p_ddot - w * w * m_p - S_rest * (theta_ddot * p_ + 2 * w * p_dot_);
  return f;
}

} // namespace ffrobot
