// The rows of a body's W in an order that suits vector registers, and the products with them that an evaluation needs.
//
// Order: frame (S_bar_x, S_bar_y, h, an empty row); ports, the rows by which constraints hold the body: (x, y) of
// markers, then angles; the rows that only kinematics asks for. Each of the last two is padded with empty rows.
#pragma once

#include "core/body/lanes.h"

#include <Eigen/Core>
#include <vector>

namespace ffrobot {

struct PlanarBody;

struct PackedRows {
  static constexpr Eigen::Index first_port = lane_count;

  explicit PackedRows(const PlanarBody &body);

  Eigen::Index rows() const { return W.rows(); }
  Eigen::Index port(Eigen::Index row) const { return place[static_cast<std::size_t>(row)] - first_port; }

  // Measure `row` of W has moved with p.
  void replace(Eigen::Index row, const Eigen::Ref<const Eigen::RowVectorXd> &values);

  // elastic_force, Wp, Wp_dot, Wk, p_p and p_p_dot
  void project(const PlanarBody &body, const double *p, const double *p_dot);

  // W_transposed_z from z
  void combine(const Eigen::VectorXd &z);

  // G of m_ff = I + U^T C U, U: the rows from `affine` on (Woodbury)
  void reduce(const Eigen::MatrixXd &C_inverse);

  // What U makes of modal forces c + W^T z: m_ff^-1 (c + W^T z) = c + W^T z' - m_ff^-1 U^T C U c, where
  // z' = z - C U m_ff^-1 W^T z in the rows of U
  void apply_inertia(const Eigen::MatrixXd &C, Eigen::VectorXd &z) const;

  std::vector<Eigen::Index> place;  // of each row of W; rows that carry nothing share the frame's empty one
  Eigen::Index ports = 0;           // padded
  Eigen::Index affine = 0;          // the first of the rows of affine inertia
  std::vector<Eigen::Index> moving; // those that move with p, of a body with affine inertia
  Eigen::MatrixXd W, W_transposed;  // (rows, n), (n padded, rows)
  Eigen::MatrixXd G;                // W m_ff^-1 W^T
  // Where m_ff is not the identity, else empty: W W^T, W U^T, and W U^T (C^-1 + U U^T)^-1
  Eigen::MatrixXd gram, with_U, reaction;
  Eigen::VectorXd elastic_force;  // (n) K p + D p_dot
  Eigen::VectorXd Wp, Wp_dot, Wk; // W p, W p_dot, W (K p + D p_dot)
  Eigen::VectorXd W_transposed_z; // (n padded)
  double p_p = 0, p_p_dot = 0;    // p . p, p . p_dot
  // by port, in body axes: 1 along x, along y, in translations, in rotations; (-1, 1) in translations: with swap_pairs
  // a quarter turn; the undeformed marker
  Eigen::VectorXd along_x, along_y, is_translation, is_rotation, turn, position;
};

} // namespace ffrobot
