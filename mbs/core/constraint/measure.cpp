#include "core/constraint/measure.h"

namespace ffrobot {

using Eigen::Vector2d;
using Eigen::Vector3d;

void evaluate(const Measure &row, const std::vector<PlanarBodyState> &bodies, MeasureMotion &motion) {
  const MarkerMotion &a = row.a.motion(bodies), &b = row.b.motion(bodies);
  motion.bias = 0; // what a slide evaluated before may have left
  switch (row.kind) {
  case MeasureKind::x:
  case MeasureKind::y: {
    const int i = row.kind == MeasureKind::x ? 0 : 1;
    motion.value = b.position[i] - a.position[i] - row.offset;
    motion.rate = b.velocity[i] - a.velocity[i];
    motion.coefficient_b = Vector3d::Unit(i);
    motion.coefficient_a = -Vector3d::Unit(i);
    return;
  }
  case MeasureKind::angle:
    motion.value = b.angle - a.angle - row.offset;
    motion.rate = b.angular_velocity - a.angular_velocity;
    motion.coefficient_b = Vector3d::UnitZ();
    motion.coefficient_a = -Vector3d::UnitZ();
    return;
  case MeasureKind::slide: {
    const double c = std::cos(a.angle), s = std::sin(a.angle), w = a.angular_velocity;
    const Vector2d n(c * row.direction.x() - s * row.direction.y(), s * row.direction.x() + c * row.direction.y());
    const Vector2d dn(-n.y(), n.x()); // derivative with respect to the angle of a
    const Vector2d d = b.position - a.position, d_dot = b.velocity - a.velocity;
    motion.value = n.dot(d) - row.offset;
    motion.rate = n.dot(d_dot) + w * dn.dot(d);
    motion.bias = 2 * w * dn.dot(d_dot) - w * w * n.dot(d);
    motion.coefficient_b << n, 0;
    motion.coefficient_a << -n, dn.dot(d);
    return;
  }
  case MeasureKind::gear: {
    const double n_b = row.gear_ratios[0], n_a = row.gear_ratios[1];
    motion.value = n_b * b.angle - n_a * a.angle - row.offset;
    motion.rate = n_b * b.angular_velocity - n_a * a.angular_velocity;
    motion.coefficient_b = n_b * Vector3d::UnitZ();
    motion.coefficient_a = -n_a * Vector3d::UnitZ();
    return;
  }
  }
}

void add_wrench(const Measure &row, const MeasureMotion &motion, double force, std::vector<Eigen::Matrix3Xd> &wrench) {
  if (row.b.body >= 0)
    wrench[static_cast<std::size_t>(row.b.body)].col(row.b.marker) += force * motion.coefficient_b;
  if (row.a.body >= 0)
    wrench[static_cast<std::size_t>(row.a.body)].col(row.a.marker) += force * motion.coefficient_a;
}

void jacobian(const Measure &row, const MeasureMotion &motion, const std::vector<PlanarBody> &bodies,
              const std::vector<PlanarBodyState> &states, const std::vector<Eigen::Index> &first_coordinate,
              Eigen::Ref<Eigen::VectorXd> gradient) {
  const auto add = [&](const MarkerReference &m, const Vector3d &coefficient) {
    if (m.body < 0)
      return;
    const auto b = static_cast<std::size_t>(m.body);
    const auto &state = states[b];
    const Vector2d &arm = state.markers[static_cast<std::size_t>(m.marker)].arm;
    auto g = gradient.segment(first_coordinate[b], bodies[b].coordinates());
    g.head<2>() += coefficient.head<2>();
    g[2] += arm.x() * coefficient[1] - arm.y() * coefficient[0] + coefficient[2];
    const Vector3d body_axes(state.cosine * coefficient[0] + state.sine * coefficient[1],
                             -state.sine * coefficient[0] + state.cosine * coefficient[1], coefficient[2]);
    g.tail(bodies[b].modes()) += state.W.middleRows<3>(3 + 3 * m.marker).transpose() * body_axes;
  };
  add(row.a, motion.coefficient_a);
  add(row.b, motion.coefficient_b);
}

} // namespace ffrobot
