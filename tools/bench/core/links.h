// Steel links of 1 m that bend, for programs that count instructions: both ends supported, or clamped at the root.
#pragma once
#include "core/recursion/model.h"

#include <cmath>

namespace ffrobot::recursion {

constexpr int points = 400;
constexpr double pi = 3.14159265358979323846, length = 1, height = 0.015, width = 0.025, density = 7850,
                 modulus = 2.068e11;

// Transverse displacement and slope of mode k of a link whose ends are supported, or which is clamped, not normalised
struct Shape {
  bool is_clamped;
  double root; // times the length: wave number

  Shape(bool clamped, int k) : is_clamped(clamped), root((k + 1) * pi) {
    if (!clamped)
      return;
    root = (k + 0.5) * pi;
    for (int i = 0; i < 20; ++i) // cos x cosh x = -1
      root -= (std::cos(root) + 1 / std::cosh(root)) / (-std::sin(root) - std::tanh(root) / std::cosh(root));
  }
  double at(double x, int derivative) const {
    const double z = root * x, scale = derivative ? root : 1;
    if (!is_clamped)
      return scale * (derivative ? std::cos(z) : std::sin(z));
    const double s = (std::sinh(root) - std::sin(root)) / (std::cosh(root) + std::cos(root));
    return scale * (derivative ? std::sinh(z) + std::sin(z) - s * (std::cosh(z) - std::cos(z))
                               : std::cosh(z) - std::cos(z) - s * (std::sinh(z) - std::sin(z)));
  }
};

inline PlanarData link(bool is_clamped, int modes = 10) {
  PlanarData data;
  const double area = height * width, mass = density * area * length, m = mass / points;
  const double bending = modulus * height * height * area / 12;
  data.mass = mass, data.inertia = mass * length * length / 3, data.first_moment = {mass * length / 2, 0};
  data.stiffness = data.h = Eigen::VectorXd::Zero(modes), data.S_bar = Eigen::MatrixXd::Zero(2, modes);
  PlanarMarker root, tip;
  tip.position = {length, 0}, root.Phi = tip.Phi = Eigen::MatrixXd::Zero(3, modes);
  for (int k = 0; k < modes; ++k) {
    const Shape shape(is_clamped, k);
    double of_mode = 0, S = 0, h = 0;
    for (int i = 0; i < points; ++i) {
      const double x = (i + 0.5) / points, u = shape.at(x, 0);
      of_mode += m * u * u, S += m * u, h += m * x * u;
    }
    const double scale = 1 / std::sqrt(of_mode);
    data.S_bar(1, k) = scale * S, data.h[k] = scale * h;
    data.stiffness[k] = bending / (density * area) * std::pow(shape.root, 4);
    root.Phi(2, k) = is_clamped ? 0 : scale * shape.at(0, 1);
    tip.Phi(1, k) = is_clamped ? scale * shape.at(1, 0) : 0, tip.Phi(2, k) = scale * shape.at(1, 1);
  }
  data.markers = {root, tip};
  return data;
}

} // namespace ffrobot::recursion
