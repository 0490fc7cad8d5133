// Scalar functions of marker motions: constraint equations, motor coordinates and the directions of applied loads.
#pragma once

#include "core/planar_body.h"

#include <Eigen/Core>
#include <vector>

namespace ffrobot {

// A marker of a body, or (body < 0) a point and direction fixed to the ground.
struct MarkerReference {
  int body = -1;
  int marker = 0;
  Eigen::Vector2d ground = Eigen::Vector2d::Zero();
};

enum class RowKind {
  x,     // (r_b - r_a)_x, global
  y,     // (r_b - r_a)_y, global
  angle, // alpha_b - alpha_a
  slide, // n . (r_b - r_a), n fixed to the section of a
};

struct Row {
  RowKind kind;
  MarkerReference a, b;
  Eigen::Vector2d direction = Eigen::Vector2d::Zero(); // of a slide, in the axes of a
  double offset = 0;                                   // the row's value at its zero
};

// value, its rate, and acceleration = coefficient_b . (acceleration of b) + coefficient_a . (… of a) + bias, with
// marker accelerations (x, y, angular). The transposed coefficients spread a force along the row over the markers.
struct RowMotion {
  double value = 0, rate = 0, bias = 0;
  Eigen::Vector3d coefficient_a = Eigen::Vector3d::Zero(), coefficient_b = Eigen::Vector3d::Zero();
};

MarkerMotion marker_motion(const MarkerReference &marker, const std::vector<PlanarBodyState> &bodies);

void evaluate(const Row &row, const std::vector<PlanarBodyState> &bodies, RowMotion &motion);

// Adds the wrench of a generalized force of size `force` along the row to its two markers.
void add_wrench(const Row &row, const RowMotion &motion, double force, std::vector<Eigen::Matrix3Xd> &wrench);

// Partial derivatives of the row with respect to the coordinates (R, theta, p) of all bodies.
void jacobian(const Row &row, const RowMotion &motion, const std::vector<PlanarBody> &bodies,
              const std::vector<PlanarBodyState> &states, const std::vector<Eigen::Index> &first_coordinate,
              Eigen::Ref<Eigen::VectorXd> gradient);

} // namespace ffrobot
