#include "core/recursion/constrained_aba/point_force.h"

#include "core/recursion/numbers/dual.h"

#include <Eigen/Geometry>

namespace ffrobot::recursion {

namespace {

using Wrench = std::array<double, 6>; // force, moment

constexpr double difference = 1e-6;

Wrench wrench_of(const StateFunction &function, double t, const Pose<double> &at) {
  Wrench found{};
  if (function.is_planar) {
    const double position[] = {at.r[0], at.r[1], at.angle}, rate[] = {at.v[0], at.v[1], at.omega[2]};
    double force[3] = {};
    function.call(t, position, rate, force);
    found[0] = force[0], found[1] = force[1], found[5] = force[2];
    return found;
  }
  double position[12], rate[6];
  for (int i = 0; i < 3; ++i) {
    position[i] = at.r[i], rate[i] = at.v[i], rate[3 + i] = at.omega[i];
    for (int j = 0; j < 3; ++j)
      position[3 + 3 * i + j] = at.R[i][j];
  }
  function.call(t, position, rate, found.data());
  return found;
}

// Frames in space do not count turns.
template <class Space> double angle_of(const Pose<double> &at) {
  return Space::dim == 3 ? at.angle : std::atan2(at.R[1][0], at.R[0][0]);
}

// Changed by h along number k: of r, of a rotation vector, of v, of omega
Pose<double> changed(Pose<double> at, int k, double h) {
  const int i = k % 3;
  if (k < 3)
    at.r[i] += h;
  else if (k >= 9)
    at.omega[i] += h;
  else if (k >= 6)
    at.v[i] += h;
  else {
    using Axes = Map<Matrix<double, 3, 3, Eigen::RowMajor>>;
    Axes R(&at.R[0][0]);
    R = Eigen::AngleAxisd(h, Vector3d::Unit(i)) * R.eval();
    at.angle += i == 2 ? h : 0;
  }
  return at;
}

// Components (dim) of a space, of force and moment
template <class Space> int component(int k) {
  if constexpr (Space::dim == 3)
    return k < 2 ? k : 5;
  return k;
}

Pose<double> values(const Pose<double> &at) { return at; }
Pose<double> values(const Pose<Dual> &at) {
  Pose<double> found;
  for (int i = 0; i < 3; ++i) {
    found.r[i] = at.r[i].value, found.v[i] = at.v[i].value, found.omega[i] = at.omega[i].value;
    for (int j = 0; j < 3; ++j)
      found.R[i][j] = at.R[i][j].value;
  }
  found.angle = at.angle.value;
  return found;
}

// Rate of number k of changed(), of which R_dot R^T is the cross product by the rotation vector
Eight rate_of(const Pose<Dual> &at, int k) {
  const int i = k % 3;
  if (k < 3)
    return at.r[i].rate;
  if (k >= 6)
    return k < 9 ? at.v[i].rate : at.omega[i].rate;
  Eight sum = Eight::zero();
  for (int j = 0; j < 3; ++j)
    sum = sum + at.R[(i + 1) % 3][j].value * at.R[(i + 2) % 3][j].rate;
  return sum;
}

template <class Space>
void add_rates(const PointForce &, double, double, const Pose<double> &, const Pose<double> &, double *) {}

template <class Space>
void add_rates(const PointForce &force, double t, double length, const Pose<Dual> &at, const Pose<double> &value,
               Dual *wrench) {
  for (int k = 0; k < 12; ++k) {
    const double h = difference * (k / 3 % 2 == 0 ? length : 1);
    const Wrench more = wrench_of(force.function, t, changed(value, k, h));
    const Wrench less = wrench_of(force.function, t, changed(value, k, -h));
    const Eight rate = rate_of(at, k);
    for (int i = 0; i < Space::dim; ++i) {
      const std::size_t c = component<Space>(i);
      wrench[i].rate = wrench[i].rate + (more[c] - less[c]) / (2 * h) * rate;
    }
  }
}

} // namespace

template <class Space, class T>
void add_at_points(const Placed<Space, T> &placed, const std::vector<PointForce> &forces, double t, double length,
                   T *wrench) {
  for (const PointForce &force : forces) {
    const Pose<T> at = wrench_pose(placed, force.wrench);
    Pose<double> value = values(at);
    value.angle = angle_of<Space>(value);
    const Wrench found = wrench_of(force.function, t, value);
    T *to = wrench + Space::dim * force.wrench;
    for (int i = 0; i < Space::dim; ++i)
      to[i] += T(found[component<Space>(i)]);
    add_rates<Space>(force, t, length, at, value, to);
  }
}

#define FFROBOT_AT_POINTS(Space, T)                                                                                    \
  template void add_at_points(const Placed<Space, T> &, const std::vector<PointForce> &, double, double, T *)

FFROBOT_AT_POINTS(Planar, double);
FFROBOT_AT_POINTS(Spatial, double);
FFROBOT_AT_POINTS(Planar, Dual);
FFROBOT_AT_POINTS(Spatial, Dual);

} // namespace ffrobot::recursion
