#include "core/space/local_coordinates.h"

#include "core/space/rotation.h"

#include <numbers>

namespace ffrobot {

LocalCoordinates::LocalCoordinates(const ConfigurationSpace &space) : space_(space) {
  if (!space_.is_flat()) {
    centre_ = VectorXd::Zero(space_.n_q());
    state_ = VectorXd::Zero(state_size());
  }
}

void LocalCoordinates::set_centre(const double *y) {
  if (space_.is_flat())
    return;
  for (const auto &of : space_.rotations())
    centre_.segment<4>(of.q) = Map<const Eigen::Vector4d>(y + of.q);
}

const double *LocalCoordinates::curved_state(const double *z) const {
  space_.integrate(centre_.data(), 1, z, state_.data());
  std::copy_n(z + space_.n_v(), space_.n_v(), state_.data() + space_.n_q());
  return state_.data();
}

void LocalCoordinates::from_state(const double *y, double *z) const {
  if (space_.is_flat())
    std::copy_n(y, size(), z);
  else {
    space_.difference(y, centre_.data(), z);
    std::copy_n(y + space_.n_q(), space_.n_v(), z + space_.n_v());
  }
}

bool LocalCoordinates::is_within_half_turns(const double *z) const {
  for (const auto &of : space_.rotations())
    if (!(Map<const Vector3d>(z + of.v).norm() < std::numbers::pi))
      return false;
  return true;
}

double LocalCoordinates::fastest_rotation(const double *v) const {
  double fastest = 0;
  for (const auto &of : space_.rotations())
    fastest = std::max(fastest, Map<const Vector3d>(v + of.v).norm());
  return fastest;
}

void LocalCoordinates::shift(double *z, double h, const double *dq) const {
  if (space_.is_flat())
    return space_.integrate(z, h, dq, z);
  const double *y = curved_state(z);
  space_.integrate(y, h, dq, state_.data());
  from_state(y, z);
}

void LocalCoordinates::rates_of_rotations(const double *z, double *z_dot) const {
  const double *v = z + space_.n_v();
  for (const auto &of : space_.rotations())
    Map<Vector3d>(z_dot + of.v) = rotation_vector_rate(Map<const Vector3d>(z + of.v), Map<const Vector3d>(v + of.v));
}

bool LocalCoordinates::recentre(double *z, double *z_dot) {
  if (space_.is_flat())
    return false;
  set_centre(curved_state(z));
  for (const auto &of : space_.rotations())
    Map<Vector3d>(z + of.v).setZero();
  rate(z, z_dot);
  return true;
}

} // namespace ffrobot
