#include "core/recursion/mechanism/orientation.h"

#include "core/recursion/spatial/section.h"

#include <Eigen/Geometry>

namespace ffrobot::recursion {

namespace {

struct Components {
  Vector3d x, rate, acceleration;
};

Matrix3d skew(const Vector3d &x) { return (Matrix3d() << 0, -x[2], x[1], x[2], 0, -x[0], -x[1], x[0], 0).finished(); }

Matrix3d about(int axis, double angle) { return Eigen::AngleAxisd(angle, Vector3d::Unit(axis)).toRotationMatrix(); }

// A = exp(psi~), omega = J_l psi_dot, alpha = J_l psi_ddot + (dJ_l/dt) psi_dot: as the section of a port turns
Turning by_vector(const Components &psi) {
  using Axes = Map<const Matrix<double, 3, 3, Eigen::RowMajor>>;
  spatial::PortMotion<double> section;
  std::copy_n(psi.x.data(), 3, section.phi), std::copy_n(psi.rate.data(), 3, section.phi_dot);
  turn_section(section);
  return {Axes(section.turn[0]), Vector3d(section.rate),
          psi.acceleration + Axes(section.excess[0]) * psi.acceleration + Vector3d(section.drift)};
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
    const Jet jet = functions[i](t);
    of.x[i] = jet.value, of.rate[i] = jet.rate, of.acceleration[i] = jet.acceleration;
  }
  if (kind == OrientationKind::direction)
    return by_direction(of);
  Turning found = kind == OrientationKind::rpy ? by_rpy(of) : by_vector(of);
  found.A *= reference;
  return found;
}

} // namespace ffrobot::recursion
