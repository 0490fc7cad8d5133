#include "core/recursion/motion/orientation.h"

#include <Eigen/Geometry>

#include <cmath>

namespace ffrobot::recursion {

using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

struct Components {
  Vector3d x, rate, acceleration;
};

// (1 - cos)/|psi|^2 for m = 2, (|psi| - sin)/|psi|^3 for m = 3, and their derivatives by x = |psi|^2. For small x by
// the sum of (-x)^k / (2 k + m)!, which is exact to rounding there; closed forms lose digits there, and only there.
std::pair<double, double> series(int m, double x) {
  if (x > 1) {
    const double angle = std::sqrt(x), a = (1 - std::cos(angle)) / x, sinc = std::sin(angle) / angle;
    const double b = (1 - sinc) / x;
    return m == 2 ? std::pair{a, 0.5 * (sinc - 2 * a) / x} : std::pair{b, 0.5 * (a - 3 * b) / x};
  }
  constexpr int terms = 10;
  double value = 0, slope = 0;
  for (int k = terms; k >= 0; --k) { // value = 1/m! - x/(m + 2)! + …, by Horner with ratios of neighbours
    const double ratio = 1.0 / ((2 * k + m + 1) * (2 * k + m + 2));
    slope = -ratio * (value + x * slope);
    value = 1 - ratio * x * value;
  }
  const double first = m == 2 ? 0.5 : 1.0 / 6;
  return {first * value, first * slope};
}

Matrix3d skew(const Vector3d &x) { return (Matrix3d() << 0, -x[2], x[1], x[2], 0, -x[0], -x[1], x[0], 0).finished(); }

Matrix3d about(int axis, double angle) { return Eigen::AngleAxisd(angle, Vector3d::Unit(axis)).toRotationMatrix(); }

// A = exp(psi~), omega = J_l psi_dot, alpha = J_l psi_ddot + (dJ_l/dt) psi_dot with J_l = I + a psi~ + b psi~^2
Turning by_vector(const Components &psi) {
  const double x = psi.x.squaredNorm(), x_dot = 2 * psi.x.dot(psi.rate);
  const auto [a, a_slope] = series(2, x);
  const auto [b, b_slope] = series(3, x);
  const Matrix3d S = skew(psi.x), square = S * S, J_l = Matrix3d::Identity() + a * S + b * square;
  const Vector3d across = psi.x.cross(psi.rate);
  return {Matrix3d::Identity() + (1 - x * b) * S + a * square, J_l * psi.rate,
          J_l * psi.acceleration + x_dot * (a_slope * across + b_slope * psi.x.cross(across)) +
              b * psi.rate.cross(across)};
}

// omega = yaw_dot e_z + pitch_dot R_z e_y + roll_dot R_z R_y e_x
Turning by_rpy(const Components &angle) {
  const Matrix3d R_z = about(2, angle.x[2]), R_zy = R_z * about(1, angle.x[1]);
  const Vector3d roll = R_zy.col(0), pitch = R_z.col(1), yaw = Vector3d::UnitZ();
  const Vector3d by_yaw = angle.rate[2] * yaw, by_pitch = angle.rate[1] * pitch;
  const Vector3d &second = angle.acceleration;
  return {R_zy * about(0, angle.x[0]), by_yaw + by_pitch + angle.rate[0] * roll,
          second[2] * yaw + second[1] * pitch + second[0] * roll + angle.rate[1] * by_yaw.cross(pitch) +
              angle.rate[0] * (by_yaw + by_pitch).cross(roll)};
}

// The shortest rotation that takes e_z to the unit vector z
Matrix3d from_e_z_to(const Vector3d &z) {
  const Vector3d axis = Vector3d::UnitZ().cross(z); // times the sine
  const double cosine = z[2], square = axis.squaredNorm();
  if (cosine < 0 && square == 0) // any axis across does
    return Vector3d(1, -1, -1).asDiagonal();
  const double share = cosine < 0 ? (1 - cosine) / square : 1 / (1 + cosine);
  return cosine * Matrix3d::Identity() + skew(axis) + share * axis * axis.transpose();
}

// omega = z x z_dot, alpha = z x z_ddot
Turning by_direction(const Components &d) {
  const double size = d.x.norm(), slope = d.rate.dot(d.x) / (size * size);
  const Vector3d z = d.x / size, z_dot = d.rate / size - slope * z;
  return {from_e_z_to(z), z.cross(z_dot), z.cross(d.acceleration / size - 2 * slope * z_dot)};
}

} // namespace

Turning OrientationLaw::operator()(double t) const {
  Components of;
  for (int i = 0; i < 3; ++i) {
    const Jet jet = functions[static_cast<std::size_t>(i)](t);
    of.x[i] = jet.value, of.rate[i] = jet.rate, of.acceleration[i] = jet.acceleration;
  }
  if (kind == OrientationKind::direction)
    return by_direction(of);
  Turning found = kind == OrientationKind::rpy ? by_rpy(of) : by_vector(of);
  found.A *= reference;
  return found;
}

} // namespace ffrobot::recursion
