#include "core/space/configuration_space.h"

#include "core/space/rotation.h"

namespace ffrobot {

using Eigen::Quaterniond;

namespace {

Quaterniond quaternion(const double *q) { return {q[0], q[1], q[2], q[3]}; }

} // namespace

ConfigurationSpace::ConfigurationSpace(Index n_v, const std::vector<Index> &rotations) : n_v_(n_v) {
  Index v = 0, q = 0;
  const auto numbers_until = [&](Index next) {
    if (next > v)
      numbers_.push_back({q, v, next - v});
    q += next - v;
    v = next;
  };
  for (const Index first : rotations) {
    numbers_until(first);
    rotations_.push_back({q, v});
    q += 4;
    v += 3;
  }
  numbers_until(n_v);
}

void ConfigurationSpace::integrate(const double *q, double h, const double *v, double *out) const {
  for (const Numbers &of : numbers_)
    for (Index i = 0; i < of.count; ++i)
      out[of.q + i] = q[of.q + i] + h * v[of.v + i];
  for (const Rotation &of : rotations_) {
    const Vector3d turn = h * Map<const Vector3d>(v + of.v);
    const Quaterniond e = (quaternion(q + of.q) * rotation_of(turn)).normalized(); // rounding does not add up
    out[of.q] = e.w();
    Map<Vector3d>(out + of.q + 1) = e.vec();
  }
}

void ConfigurationSpace::difference(const double *q1, const double *q0, double *dq) const {
  for (const Numbers &of : numbers_)
    for (Index i = 0; i < of.count; ++i)
      dq[of.v + i] = q1[of.q + i] - q0[of.q + i];
  for (const Rotation &of : rotations_)
    Map<Vector3d>(dq + of.v) = rotation_vector(quaternion(q0 + of.q).conjugate() * quaternion(q1 + of.q));
}

} // namespace ffrobot
