// A planar flexible body in the floating frame of reference, coordinates (R, theta, p): where its markers are, and the
// forces of a known motion. What moves it is found in joint coordinates (core/recursion). Units: SI; modes are
// mass-orthonormal, so that p is in m sqrt(kg).
#pragma once

#include "core/body/affine_inertia.h"

#include <Eigen/Core>
#include <vector>

namespace ffrobot {

// A second-order displacement of a marker: row r of W p has -1/2 p^T K p besides, K (n, n) the geometric stiffness of a
// unit load along that row.
struct SecondOrder {
  Eigen::Index row;
  Eigen::MatrixXd K;
};

// Constants of one body. Formulas: Shabana, Dynamics of Multibody Systems, ch. 5; symbols as there. In the rows of
//   W = [S_bar_x; S_bar_y; h; Phi_x, Phi_y, Phi_rotation of marker 1; of marker 2; ...]     (3 + 3 markers) x n
// is what modes do to the frame's rows of the mass matrix and to markers (row h moves with p where S_tilde is not
// zero).
struct PlanarBody {
  double mass = 0;                               // kg
  double inertia = 0;                            // kg m^2, J2_11 + J2_22, about the origin of the frame
  Eigen::Vector2d first_moment;                  // kg m, s0
  Eigen::VectorXd stiffness;                     // (n) 1/s^2, diagonal of K_ff
  Eigen::MatrixXd damping;                       // 1/s, (n, 1) diagonal of D_ff, or (n, n)
  Eigen::MatrixXd W;                             // (3 + 3 markers, n)
  Eigen::VectorXd j;                             // (n) I_bar_11 + I_bar_22; empty where it vanishes
  Eigen::MatrixXd S_tilde;                       // (n, n) S_bar_12 - S_bar_21, skew; empty where it vanishes
  Eigen::MatrixXd m_xy;                          // (n, n) S_bar_11 + S_bar_22; empty where it is the identity
  std::vector<Eigen::Vector2d> marker_positions; // m, undeformed, body frame
  // Geometric stiffening: W(p) = W - (K p)^T in place of W at markers; the inertia. Both empty where it is left out.
  std::vector<SecondOrder> second_order;
  AffineInertia affine;

  Eigen::Index modes() const { return W.cols(); }
  Eigen::Index markers() const { return static_cast<Eigen::Index>(marker_positions.size()); }
  Eigen::Index coordinates() const { return 3 + modes(); }
};

inline Eigen::Vector2d perpendicular(const Eigen::Vector2d &v) { return {-v.y(), v.x()}; }

// Puts geometric stiffening into the inertia of a body that is complete otherwise; K of AffineInertia.
void stiffen(PlanarBody &body, const std::array<Eigen::MatrixXd, 4> &K);

// Motion of one marker in the global frame: m, m/s, rad, rad/s.
struct MarkerMotion {
  Eigen::Vector2d arm; // from the frame's origin, deformed
  Eigen::Vector2d position;
  Eigen::Vector2d velocity;
  double angle;
  double angular_velocity;
};

// Workspace of one body.
struct PlanarBodyState {
  explicit PlanarBodyState(const PlanarBody &body);

  // kinematics
  double cosine = 1, sine = 0, theta_dot = 0;
  std::vector<MarkerMotion> markers;
  Eigen::MatrixXd W;                  // as it is at p
  Eigen::VectorXd displacement, rate; // (rows of W) W p with its second-order part; W(p) p_dot
  Eigen::VectorXd convective;         // (rows of W) p_dot^T K p_dot; zero without geometric stiffening
  AffineMotion affine;                // of a body with geometric stiffening

  // applied loads, zero unless they are set
  Eigen::Matrix3Xd wrench;    // (force x, force y, moment) at each marker, global: N, N m
  Eigen::VectorXd modal_load; // (n) generalized forces on p
};

// Positions and velocities of the markers for q = (R, theta, p), v = its rates.
void kinematics(const PlanarBody &body, const double *q, const double *v, PlanarBodyState &state);

// Acceleration (x, y, angular) of marker k for accelerations a of the coordinates. After kinematics.
Eigen::Vector3d marker_acceleration(const PlanarBody &body, const PlanarBodyState &state, Eigen::Index k,
                                    const double *a);

// Generalized force on p of wrenches on the markers (global axes): F_p += sum Phi_k^T A^T f_k + ...
void add_modal_force(const PlanarBody &body, const PlanarBodyState &state, const Eigen::Matrix3Xd &wrench,
                     Eigen::Ref<Eigen::VectorXd> modal_force);

// Generalized forces Q_R, Q_theta, Q_f of gravity, elasticity and applied loads at rest (static equilibrium).
void static_force(const PlanarBody &body, const double *q, const Eigen::Vector2d &gravity, const PlanarBodyState &state,
                  double *Q);

// Generalized force M a - Q on (R, theta, p) that the motion (q, v, a) needs, beside gravity, elasticity, damping and
// the applied loads. After kinematics.
void required_force(const PlanarBody &body, const double *q, const double *v, const double *a,
                    const Eigen::Vector2d &gravity, const PlanarBodyState &state, double *f);

} // namespace ffrobot
