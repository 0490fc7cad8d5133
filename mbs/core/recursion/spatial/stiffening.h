// Constants of a spatial body with geometric stiffening. To second order its points are, in its frame, at
//
//     r(x) = x + Phi(x) p - 1/2 p^T G(x) p
//
// In the inertia (not at markers) the second-order field is replaced by its mass-weighted projection on affine fields,
// the products of 1, x, y, z with the three axes; what Phi p has beside these stays as in the linear body. The kinetic
// energy is then a sum of squares, so that M is positive definite however far the body is bent.
//
// Scalar fields phi_f, combinations of 1, x, y, z that are orthonormal under the mass; a line of mass has two of them.
// By axis c and field f, products with the modes, with G, and with the position of the undeformed body:
//     F_cf = integral of phi_f Phi_c dm (n)     K_cf = integral of phi_f G_c dm (n, n)     g_cf
// Then F(p) = F - K p are products of the fields with the modes of the bent body, and its affine part is known by
//     g(p) = g + F p - 1/2 p^T K p,     s = g_c0 sqrt(m),     J2(p) = g g^T + …,     m_ff = 1 - F^T F + F(p)^T F(p)
#pragma once

#include "core/recursion/model.h"
#include "core/recursion/spatial/mode_matrix.h"

namespace ffrobot::recursion::spatial {

constexpr int most_fields = 4;

struct Stiffening {
  // K of markers: along the axes of the undeformed section; `used` are ports
  Stiffening(const SpatialData &data, const std::vector<int> &used);

  int fields = 0;                   // 1 (all mass in a point) to 4
  double root_mass = 0;             // of phi_0 = 1/root_mass
  double g[3][most_fields] = {};    // of the undeformed body
  Aligned<double> F;                // (3 fields, padded n)
  std::vector<ModeMatrix> K;        // (3 fields)
  Aligned<double> m_ff_rest;        // (n, padded n): 1 - sum of F F^T over rows with K, which change
  std::vector<ModeMatrix> at_ports; // of rows of W from the first port on

  const double *row(int field, int n) const { return F.data() + field * padded(n); }

private:
  void project(const SpatialData &data);
  void fill_ports(const SpatialData &data, const std::vector<int> &used);
};

// What of K of its markers is nothing but rounding
double negligible_K(const SpatialData &data);

} // namespace ffrobot::recursion::spatial
