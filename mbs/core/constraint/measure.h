// Scalar functions of marker motions: constraint equations, motor coordinates and the directions of applied loads.
#pragma once

#include "core/body/planar_body.h"

#include <Eigen/Core>
#include <vector>

namespace ffrobot {

// A marker of a body, or (body < 0) a point and direction fixed to the ground.
struct MarkerReference {
  MarkerReference(int body, int marker, const Eigen::Vector2d &ground)
      : body(body), marker(marker), ground{Eigen::Vector2d::Zero(), ground, Eigen::Vector2d::Zero(), 0, 0} {}

  int body;
  int marker;
  MarkerMotion ground;

  const MarkerMotion &motion(const std::vector<PlanarBodyState> &bodies) const {
    return body < 0 ? ground : bodies[static_cast<std::size_t>(body)].markers[static_cast<std::size_t>(marker)];
  }
};

enum class MeasureKind {
  x,     // (r_b - r_a)_x, global
  y,     // (r_b - r_a)_y, global
  angle, // alpha_b - alpha_a (x, y and angle in the order of a marker's rows)
  slide, // n . (r_b - r_a), n fixed to the section of a
  gear,  // n_b alpha_b - n_a alpha_a, the angle between shafts behind gears: n_b = N, n_a = N - 1 is that of a rotor
         // on a that turns N times as fast as b does on a
};

struct Measure {
  MeasureKind kind;
  MarkerReference a, b;
  Eigen::Vector2d direction = Eigen::Vector2d::Zero();   // n of a slide, in the axes of a
  Eigen::Vector2d gear_ratios = Eigen::Vector2d::Zero(); // (n_b, n_a) of a gear
  double offset = 0;                                     // m or rad: the row's value at its zero
};

// value (m or rad), its rate, and acceleration = coefficient_b . (acceleration of b) + coefficient_a . (… of a) + bias,
// with marker accelerations (x, y, angular). The transposed coefficients spread a force along the row over the markers.
struct MeasureMotion {
  double value = 0, rate = 0, bias = 0;
  Eigen::Vector3d coefficient_a = Eigen::Vector3d::Zero(), coefficient_b = Eigen::Vector3d::Zero();
};

void evaluate(const Measure &row, const std::vector<PlanarBodyState> &bodies, MeasureMotion &motion);

// Adds the wrench of a generalized force of size `force` along the row to its two markers.
void add_wrench(const Measure &row, const MeasureMotion &motion, double force, std::vector<Eigen::Matrix3Xd> &wrench);

// Partial derivatives of the row with respect to the coordinates (R, theta, p) of all bodies.
void jacobian(const Measure &row, const MeasureMotion &motion, const std::vector<PlanarBody> &bodies,
              const std::vector<PlanarBodyState> &states, const std::vector<Eigen::Index> &first_coordinate,
              Eigen::Ref<Eigen::VectorXd> gradient);

} // namespace ffrobot
