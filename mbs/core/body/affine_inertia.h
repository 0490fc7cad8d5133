// Inertia of a body with geometric stiffening. To second order, the positions in its frame are
//
//     r(x) = x + Phi(x) p - 1/2 p^T G(x) p
//
// In the inertia (not at markers) the second-order field is replaced by its mass-weighted projection on the four affine
// fields (1, 0), (0, 1), (x, y) and (-y, x). What Phi p has beside these stays as in the linear body. The kinetic
// energy is then that of an affinely deforming body plus that of the rest: a sum of squares, so that M is positive
// definite however far the body is bent. In the order of the fields:
//
//     N       (4, 4)  their mass matrix, of m, s0 and J
//     F       (4, n)  (S_bar_x, S_bar_y, j, h): their products with the modes
//     K       (4, n, n)  (K_s,x, K_s,y, K_omega, K_h), geometric stiffness: their products with G
//     F(p)  = F - (K p)^T
//     g(p)  = N e_3 + F p - 1/2 p^T K p      their products with r; g_1, g_2 are the first moment
//     u(p)  = N^-1 g                         the affine part of r
//     X     = (N e_1, N e_2, i g, F(p))      their products with the velocities of (R, theta, p), R in body axes
//     M     = X^T N^-1 X + that of the rest
//
// i turns a field by a right angle: i (x, y, stretch, turn) = (-y, x, -turn, stretch).
#pragma once

#include <Eigen/Core>
#include <array>

namespace ffrobot {

using Matrix4Xd = Eigen::Matrix<double, 4, Eigen::Dynamic>;

struct AffineInertia {
  AffineInertia() = default;
  // m_xy: with the rotary inertia of point masses on the body; K[i] is empty where it vanishes.
  AffineInertia(double mass, const Eigen::Vector2d &first_moment, double inertia, const Matrix4Xd &F,
                const Eigen::MatrixXd &m_xy, const Eigen::MatrixXd &S_tilde, const std::array<Eigen::MatrixXd, 4> &K);

  explicit operator bool() const { return F.cols() > 0; }
  Eigen::Index modes() const { return F.cols(); }

  Eigen::Matrix4d N, N_inverse;
  Matrix4Xd F;
  std::array<Eigen::MatrixXd, 4> K;
  Eigen::MatrixXd m_xy_rest, S_tilde_rest, m_ff_rest; // of what the modes have beside affine fields
};

// The affine part of a body's motion at (p, p_dot).
struct AffineMotion {
  Matrix4Xd F;               // F(p)
  Eigen::Vector4d g, g_dot;  // g_dot = F(p) p_dot
  Eigen::Vector4d curvature; // p_dot^T K p_dot
  Eigen::VectorXd K_p;       // (n) for one field after the other
};

void update(const AffineInertia &inertia, const double *p, const double *p_dot, AffineMotion &motion);

// Inertia forces M a - Q (3 + n), R in body axes, under accelerations a = (A^T (R_ddot - g), theta_ddot, p_ddot).
Eigen::VectorXd inertia_force(const AffineInertia &inertia, const AffineMotion &motion, const double *p,
                              const double *p_dot, double theta_dot, const Eigen::VectorXd &a);

} // namespace ffrobot
