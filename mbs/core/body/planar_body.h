// A planar flexible body in the floating frame of reference: coordinates (R, theta, p).
//
// Constraints and their elimination need of it the free accelerations of its ports (directions in which constraints
// hold its markers), and their mobility (the acceleration of one per unit force on another). Units: SI; modes are
// mass-orthonormal, so that p is in m sqrt(kg).
#pragma once

#include "core/body/affine_inertia.h"
#include "core/body/packed_rows.h"

#include <Eigen/Core>
#include <vector>

namespace ffrobot {

// A second-order displacement of a marker: row r of W p has -1/2 p^T K p besides, K (n, n) the geometric stiffness of a
// unit load along that row.
struct SecondOrder {
  Eigen::Index row;
  Eigen::MatrixXd K;
};

// Constants of one body. Formulas: Shabana, Dynamics of Multibody Systems, ch. 5; symbols as there.
//
// The p-block of the mass matrix is the identity (mass-orthonormal modes), so p is eliminated exactly:
// p_ddot = Q_f - S_bar^T a - m_thetaf^T alpha + sum of Phi_k^T f_k. Everything the elimination needs are products with
//   W = [S_bar_x; S_bar_y; h; Phi_x, Phi_y, Phi_rotation of marker 1; of marker 2; ...]     (3 + 3 markers) x n
// and its Gram matrix G = W W^T, both constant in the body frame (row h moves with p where S_tilde is not zero).
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
  std::vector<int> marker_rows; // that constraints use: 0, 2 (translation) or 3 (rotation too); set by System::finish
  // Geometric stiffening: W(p) = W - (K p)^T in place of W at markers; the inertia, whose rows W has behind those of
  // the markers. Both empty where it is left out.
  std::vector<SecondOrder> second_order;
  AffineInertia affine;

  Eigen::Index modes() const { return W.cols(); }
  Eigen::Index markers() const { return static_cast<Eigen::Index>(marker_positions.size()); }
  Eigen::Index coordinates() const { return 3 + modes(); }
  Eigen::Index affine_row() const { return 3 + 3 * markers(); }
  bool is_stiffened() const { return affine || !second_order.empty(); }
};

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

// Workspace of one body; nothing is allocated after construction.
struct PlanarBodyState {
  explicit PlanarBodyState(const PlanarBody &body);

  // kinematics
  double cosine = 1, sine = 0, theta_dot = 0;
  std::vector<MarkerMotion> markers;

  // applied loads, set between kinematics and free_motion
  Eigen::Matrix3Xd wrench;    // (force x, force y, moment) at each marker, global: N, N m
  Eigen::VectorXd modal_load; // (n) generalized forces on p
  bool has_wrench = false, has_modal_load = false;
  bool has_load = false; // wrenches, or forces on affine rows: there is something in z

  // Ports, in global axes: the translations and rotations of markers by which constraints hold the body (PackedRows).
  Eigen::VectorXd port_acceleration; // before constraint forces
  Eigen::MatrixXd mobility;          // acceleration of a port per unit force on another; from each diagonal entry down
  Eigen::VectorXd port_force;        // of constraints; set before accelerations and apply_inverse_mass

  // internals of the elimination
  Eigen::MatrixXd W;              // (3 + 3 markers, n), as it is at p
  PackedRows rows;                // the same, and products with it
  Eigen::VectorXd displacement;   // packed W p, its second-order part right
  Eigen::VectorXd convective;     // p_dot^T K p_dot, by packed rows; zero without geometric stiffening
  AffineMotion affine;            // of a body with geometric stiffening
  Eigen::VectorXd extra, W_extra; // modal forces outside the common fast path, and packed W times them
  bool has_extra = false;
  Eigen::VectorXd curvature;  // (n) K p of a second-order displacement
  Eigen::VectorXd z, none;    // applied wrenches in body axes and forces on affine rows, by packed rows; none at all
  Eigen::VectorXd z_response; // multipliers of the packed rows in p_ddot
  Eigen::MatrixXd Z; // (ports, 3) B L^-T: B port acceleration per (a, alpha) of the frame, global by body axes, with p
                     // eliminated; L D L^T the eliminated mass matrix
  Eigen::Vector3d L; // (L_10, L_20, L_21)
  Eigen::Vector3d D_inverse;
  Eigen::Vector3d free_frame; // free (a, alpha) of the body frame, body axes
  Eigen::Vector2d gravity;    // body axes
  Eigen::Vector2d moment;     // s0 + S_bar p
  double inertia = 0;         // m_thetatheta
};

// Positions and velocities of the markers for q = (R, theta, p), v = its rates.
void kinematics(const PlanarBody &body, const double *q, const double *v, PlanarBodyState &state);

// Eliminates p under gravity and the applied loads: free accelerations of the ports and mobility. After kinematics.
void free_motion(const PlanarBody &body, const double *q, const double *v, const Eigen::Vector2d &gravity,
                 PlanarBodyState &state);

// Accelerations of (R, theta, p) under state.port_force. After free_motion.
void accelerations(const PlanarBody &body, const double *q, PlanarBodyState &state, double *a);

// Acceleration (x, y, angular) of marker k for accelerations a of the coordinates, and the sum of its terms' sizes:
// those of the elastic forces in p_ddot too, which cancel against others when a stiff link hardly vibrates.
Eigen::Vector3d marker_acceleration(const PlanarBody &body, const PlanarBodyState &state, Eigen::Index k,
                                    const double *q, const double *a, double &size);

// M^-1 times the generalized force of state.port_force (mass metric of the last free_motion).
void apply_inverse_mass(const PlanarBody &body, PlanarBodyState &state, double *dq);

// Generalized force on p of wrenches on the markers (global axes): F_p += sum Phi_k^T A^T f_k + ...
void add_modal_force(const PlanarBody &body, const PlanarBodyState &state, const Eigen::Matrix3Xd &wrench,
                     Eigen::Ref<Eigen::VectorXd> modal_force);

// Generalized forces Q_R, Q_theta, Q_f of gravity and elasticity at rest (static equilibrium).
void static_force(const PlanarBody &body, const double *q, const Eigen::Vector2d &gravity, PlanarBodyState &state,
                  double *Q);

// Generalized force M a - Q on (R, theta, p) that the motion (q, v, a) needs, beside gravity, elasticity, damping and
// the applied loads. After kinematics.
void required_force(const PlanarBody &body, const double *q, const double *v, const double *a,
                    const Eigen::Vector2d &gravity, PlanarBodyState &state, double *f);

// p^T (S_bar_11 + S_bar_22) x, both (n)
double weighted(const PlanarBody &body, const double *p, const double *x);

// Kinetic, strain and gravitational energy (J) and the power of damping (W).
struct Energy {
  double kinetic = 0, strain = 0, gravitational = 0, dissipated_power = 0;
};
Energy energy(const PlanarBody &body, const double *q, const double *v, const Eigen::Vector2d &gravity);

} // namespace ffrobot
