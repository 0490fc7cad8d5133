// Constants of a planar body with geometric stiffening, as spatial/stiffening.h has them of one in space. Here the
// affine fields are four: translations along x and y, stretch and turn about the center of mass, each of norm 1 under
// the mass, so that they are orthonormal.
//
// Products of the fields with the modes, with G, and with the position of the undeformed body:
//     F (4, n)     K (4, n, n)     g (4)
// and, with F(p) = F - K p, of the bent body:
//     g(p) = g + F p - 1/2 p^T K p,     s = (g_0, g_1) sqrt(m),     m_ff = 1 - F^T F + F(p)^T F(p)
#pragma once

#include "core/recursion/model.h"
#include "core/recursion/spatial/mode_matrix.h"

namespace ffrobot::recursion::planar {

constexpr int fields = 4;

struct Stiffening {
  // `used`: markers of `data` that are ports; first_rows: of W, where these are
  Stiffening(const PlanarData &data, const std::vector<int> &used, const std::vector<int> &first_rows);

  struct Row {
    int row; // of W
    ModeMatrix K;
  };

  double root_mass = 0;  // the first two fields are 1/root_mass
  double g[fields] = {}; // of the undeformed body
  Aligned<double> F;     // (n, 4) transposed
  ModeMatrix K[fields];
  Aligned<double> m_ff_rest; // (n, n) 1 - F^T F
  std::vector<Row> at_ports; // rows of ports that bending changes
};

// Whether a marker moves (x, y of its axes) or turns to second order along component 0, 1 or 2
bool is_curved(const PlanarData &data, const PlanarMarker &marker, int component);

// x_k = R_kl y_l of matrices
std::vector<MatrixXd> turned(const Matrix2d &R, const std::vector<MatrixXd> &y);

// K of data about another point, along other axes: those that R turns into (x, y)
std::vector<MatrixXd> moved_K(const PlanarData &data, const Vector2d &position, const Matrix2d &R);

} // namespace ffrobot::recursion::planar
