// The constants of a spatial flexible body as the recursion needs them. A = (a; alpha): acceleration of the origin,
// less gravity, and angular acceleration, both in body axes.
//
// With u = x + S p, everything of the inertia that moves follows from B_ab = integral of u_a S_b dm = I_bar_ab +
// S_bar_ab^T p (formulation of a spatial body, sections 2 and 3). Its symmetric part makes the inertia and centrifugal
// forces, its antisymmetric part m_thetaf and Coriolis forces:
//     B = sum over s of T_s b_s + antisymmetric,   b_s = g_s + G_s p,   m_thetaf = h + sum over c of z_c (A_c p)
// with constant tensors T_s = z_a z_b^T + z_b z_a^T of the axes z in which the modes are given. What vanishes there is
// left out: of a straight beam, which moves across itself, three of six G_s and two of three A_c.
//
// Rows of W lie side by side, eight and eight: S_bar, h and two more; then Phi of each port and two more. Phi is along
// the axes of the undeformed section. What is left of each eight holds the g_s, two and two (more eights where they
// need them); these are in W alone, not in `rows` and G, which the other products are made of.
#pragma once

#include "core/recursion/spatial/stiffening.h"

#include <memory>

namespace ffrobot::recursion::spatial {

struct Port {
  double r[3] = {};              // undeformed, body axes
  double R[3][3] = {};           // its axes, undeformed: columns
  int row = 8;                   // its first in W
  double T[6][lanes] = {};       // X - P m^T of the undeformed body; with geometric stiffening, X
  double turning[3][lanes] = {}; // axes of the section, in the place of alpha
  bool is_flexible = false;      // some row of Phi is not zero
};

// T_s and b_s
struct Stretch {
  double inertia[lanes] = {}; // (tr T) I - T, as symmetric matrices are kept (small.h)
  int g_row = -1;             // of W, -1: g is zero
  int twist = -1;             // whose A is made of G
  Aligned<double> g;
  ModeMatrix G;
};

// z_c and A_c. Where each mode moves along one axis alone, as those of straight beams do, A is G of these two axes, 2
// or -2 times, mode by mode.
struct Twist {
  double axis[lanes] = {}; // in the place of alpha
  ModeMatrix A;
  Aligned<double> by_stretch; // A = diag(these) G; empty: A is known by itself
};

struct Body {
  static constexpr int S = 0, h = 3;
  Body() = default;
  Body(const SpatialData &data, const std::vector<int> &used);

  int n = 0, width = 8;
  double mass = 0, s0[3] = {};
  double J0[lanes] = {};          // inertia with that of spin, as symmetric matrices are kept
  double residual[6][lanes] = {}; // M_rr - m m^T of the undeformed body
  Aligned<double> W;              // (even n, width) transposed, with all g_s
  Aligned<double> rows;           // (width, padded n)
  Aligned<double> G;              // (width, width) W W^T
  Aligned<double> K, D;           // (padded n) stiffness; damping where it is diagonal
  bool is_damped = false;
  MatrixXd D_full; // damping where it is not diagonal
  std::vector<Port> ports;
  std::vector<Stretch> stretches;               // at most six
  double tension[6][lanes] = {};                // of w_x^2, w_y^2, w_z^2, w_x w_y, w_y w_z, w_z w_x: by stretches
  std::vector<Twist> twists;                    // at most three; none: m_thetaf does not change
  std::shared_ptr<const Stiffening> stiffening; // null without

  int row_count() const { return width; }
  const double *constant_rows() const { return W.data(); } // transposed
  const double *gram(int r, int c) const { return G.data() + r * width + c; }

private:
  bool is_curved(int row) const;
  void fill_rows(const SpatialData &data, const std::vector<int> &used, const MatrixXd &I_bar);
  void fill_residuals(const SpatialData &data, const std::vector<int> &used);
  void fill_tensors(const SpatialData &data, const Matrix3d &axes, const MatrixXd &g);
  int add_to_W(const VectorXd &g);
  int add_stretch(const Matrix3d &T, const MatrixXd &G, const VectorXd &g);
};

// The same body with its frame at `position`, its axes the columns of `triad`.
SpatialData moved(const SpatialData &data, const Vector3d &position, const Matrix3d &triad);

// K of a marker along its axes, six or none
std::vector<MatrixXd> section_K(const SpatialMarker &marker);

} // namespace ffrobot::recursion::spatial
