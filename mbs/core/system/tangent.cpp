#include "core/system/tangent.h"

#include "core/body/planar_tangent.h"

#include <algorithm>

namespace ffrobot {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Ref;
using Eigen::RowVectorXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

// n of a slide, its derivative with respect to the angle of a, and the way from a to b.
struct SlideAxes {
  SlideAxes(const Measure &row, const MarkerMotion &a, const MarkerMotion &b) : d(b.position - a.position) {
    const double c = std::cos(a.angle), s = std::sin(a.angle);
    n << c * row.direction.x() - s * row.direction.y(), s * row.direction.x() + c * row.direction.y();
    n_alpha << -n.y(), n.x();
  }
  Vector2d n, n_alpha, d;
};

// Derivatives of the acceleration of one of a row's markers; `coefficient` weighs (x, y, angular).
void add_marker(const System &system, const Workspace &w, const MarkerReference &m, const double *v, const double *a,
                const Vector3d &acceleration, const Vector3d &velocity, const Vector3d &position, Index i,
                RowTangents &result) {
  if (m.body < 0)
    return;
  const auto b = static_cast<std::size_t>(m.body);
  const Index first = system.first_coordinate[b], size = system.bodies[b].coordinates();
  MarkerTangent marker;
  marker_tangent(system.bodies[b], w.bodies[b], m.marker, v + first, a + first, marker);
  const auto &[L, V, P] = marker;
  result.by_acceleration.row(i).segment(first, size) += acceleration.transpose() * L;
  result.by_velocity.row(i).segment(first, size) += acceleration.transpose() * V + velocity.transpose() * L;
  result.by_position.row(i).segment(first, size) +=
      acceleration.transpose() * P + 0.5 * velocity.transpose() * V + position.transpose() * L;
}

Vector3d acceleration_of(const System &system, const Workspace &w, const MarkerReference &m, const double *q,
                         const double *a) {
  if (m.body < 0)
    return Vector3d::Zero();
  const auto b = static_cast<std::size_t>(m.body);
  const Index first = system.first_coordinate[b];
  double size = 0;
  return marker_acceleration(system.bodies[b], w.bodies[b], m.marker, q + first, a + first, size);
}

// The curvature of a slide beyond that of its markers: x^T alpha_q + alpha_q^T x, x = n_alpha . d_q - (n . d)
// alpha_q/2.
void add_slide_curvature(const System &system, const Measure &row, double multiplier, const Workspace &w,
                         Ref<MatrixXd> K) {
  if (row.a.body < 0)
    return;
  const SlideAxes axes(row, row.a.motion(w.bodies), row.b.motion(w.bodies));
  VectorXd x = VectorXd::Zero(system.n_v()), alpha = x;
  MeasureMotion of_x, of_alpha;
  of_x.coefficient_b << axes.n_alpha, 0;
  of_x.coefficient_a << -axes.n_alpha, -0.5 * axes.n.dot(axes.d);
  of_alpha.coefficient_a = Vector3d::UnitZ();
  jacobian(row, of_x, system.bodies, w.bodies, system.first_coordinate, x);
  jacobian(row, of_alpha, system.bodies, w.bodies, system.first_coordinate, alpha);
  K.noalias() += multiplier * x * alpha.transpose();
  K.noalias() += multiplier * alpha * x.transpose();
}

} // namespace

void add_row_curvature(const System &system, const Measure &row, double multiplier, const Workspace &w,
                       Ref<MatrixXd> K) {
  MeasureMotion motion;
  evaluate(row, w.bodies, motion);
  for (const auto &[m, coefficient] :
       {std::pair(&row.a, &motion.coefficient_a), std::pair(&row.b, &motion.coefficient_b)}) {
    if (m->body < 0)
      continue;
    const auto b = static_cast<std::size_t>(m->body);
    const Index first = system.first_coordinate[b], size = system.bodies[b].coordinates();
    add_marker_curvature(system.bodies[b], w.bodies[b], m->marker, multiplier * *coefficient,
                         K.block(first, first, size, size));
  }
  if (row.kind == MeasureKind::slide)
    add_slide_curvature(system, row, multiplier, w, K);
}

void row_tangent(const System &system, const Measure &row, const double *q, const double *v, const double *a,
                 const Workspace &w, Index i, RowTangents &result) {
  result.by_acceleration.row(i).setZero();
  result.by_velocity.row(i).setZero();
  result.by_position.row(i).setZero();
  MeasureMotion motion;
  evaluate(row, w.bodies, motion);
  // of velocities and positions of the markers a and b
  Vector3d velocity_a = Vector3d::Zero(), velocity_b = velocity_a, position_a = velocity_a, position_b = velocity_a;
  if (row.kind == MeasureKind::slide) {
    const MarkerMotion &m_a = row.a.motion(w.bodies), &m_b = row.b.motion(w.bodies);
    const SlideAxes axes(row, m_a, m_b);
    const Vector3d a_a = acceleration_of(system, w, row.a, q, a), a_b = acceleration_of(system, w, row.b, q, a);
    const Vector2d d_dot = m_b.velocity - m_a.velocity, d_ddot = (a_b - a_a).head<2>();
    const double rate = m_a.angular_velocity, acceleration = a_a[2];
    const auto &[n, n_alpha, d] = axes;
    velocity_b << 2 * rate * n_alpha, 0;
    velocity_a << -2 * rate * n_alpha, 2 * n_alpha.dot(d_dot) - 2 * rate * n.dot(d);
    position_b << acceleration * n_alpha - rate * rate * n, 0;
    position_a << -position_b.head<2>(),
        n_alpha.dot(d_ddot) - 2 * rate * n.dot(d_dot) - rate * rate * n_alpha.dot(d) - acceleration * n.dot(d);
  }
  add_marker(system, w, row.a, v, a, motion.coefficient_a, velocity_a, position_a, i, result);
  add_marker(system, w, row.b, v, a, motion.coefficient_b, velocity_b, position_b, i, result);
}

namespace {

// Springs between angles, whose gradients are constant.
void add_springs(const System &system, const Workspace &w, Tangent &result) {
  MeasureMotion motion;
  for (const Spring &spring : system.springs) {
    VectorXd motor = VectorXd::Zero(system.n_v()), joint = motor;
    evaluate(spring.motor, w.bodies, motion);
    jacobian(spring.motor, motion, system.bodies, w.bodies, system.first_coordinate, motor);
    evaluate(spring.joint, w.bodies, motion);
    jacobian(spring.joint, motion, system.bodies, w.bodies, system.first_coordinate, joint);
    motor -= joint;
    result.K.noalias() += spring.stiffness * motor * motor.transpose();
    result.D.noalias() += spring.damping * motor * motor.transpose();
  }
}

// Rotors, whose moments are J row_ddot along their rows, and friction, which goes with row_dot.
void add_built_joints(const System &system, const double *q, const double *v, const double *a, Workspace &w,
                      Tangent &result) {
  RowTangents row(1, system.n_v());
  MeasureMotion motion;
  VectorXd gradient(system.n_v());
  const auto look_at = [&](const Measure &r) {
    evaluate(r, w.bodies, motion);
    row_tangent(system, r, q, v, a, w, 0, row);
    gradient = row.by_acceleration.row(0).transpose();
  };
  for (const auto &[rotor, compliance] : system.rotors) {
    look_at(rotor);
    const double moment = row_acceleration(system, rotor, motion, q, a, w) / compliance;
    result.force += moment * gradient;
    gradient /= compliance;
    result.M.noalias() += gradient * row.by_acceleration;
    result.D.noalias() += gradient * row.by_velocity;
    result.K.noalias() += gradient * row.by_position;
    add_row_curvature(system, rotor, moment, w, result.K);
  }
  for (const Drive &drive : system.drives) {
    if (!drive.friction.acts())
      continue;
    look_at(drive.row);
    gradient *= drive.friction.slope(motion.rate);
    result.D.noalias() += gradient * row.by_acceleration;
    result.K.noalias() += 0.5 * gradient * row.by_velocity;
    add_row_curvature(system, drive.row, drive.friction.resistance(motion.rate), w, result.K);
  }
}

// Derivatives of a state force by positions and rates are central differences: how it is made is not known here.
void add_state_force(const System &system, const StateForce &force, double t, const double *q, const double *v,
                     const double *a, Workspace &w, Tangent &result) {
  constexpr double small = 1e-6;
  const MarkerReference ground(-1, 0, Eigen::Vector2d::Zero());
  const MarkerMotion &m = force.marker.motion(w.bodies);
  const Vector3d position(m.position.x(), m.position.y(), m.angle);
  const Vector3d rate(m.velocity.x(), m.velocity.y(), m.angular_velocity);
  const Vector3d steps = small * Vector3d(system.length, system.length, 1), now = force(t, position, rate);
  Eigen::Matrix3d by_position, by_rate;
  RowTangents rows(3, system.n_v());
  const MeasureKind kinds[] = {MeasureKind::x, MeasureKind::y, MeasureKind::angle};
  for (Index i = 0; i < 3; ++i) {
    const Vector3d step = steps[i] * Vector3d::Unit(i);
    by_position.col(i) = (force(t, position + step, rate) - force(t, position - step, rate)) / (2 * steps[i]);
    by_rate.col(i) = (force(t, position, rate + step) - force(t, position, rate - step)) / (2 * steps[i]);
    const Measure row{kinds[i], ground, force.marker};
    row_tangent(system, row, q, v, a, w, i, rows);
    add_row_curvature(system, row, -now[i], w, result.K);
  }
  const MatrixXd to_coordinates = rows.by_acceleration.transpose();
  result.D.noalias() -= to_coordinates * by_rate * rows.by_acceleration;
  result.K.noalias() -= to_coordinates * (by_position * rows.by_acceleration + 0.5 * by_rate * rows.by_velocity);
}

} // namespace

void tangent(const System &system, double t, const double *q, const double *v, const double *a, Workspace &w,
             Tangent &result) {
  required_force(system, t, q, v, a, w, result.force.data());
  for (auto *matrix : {&result.M, &result.D, &result.K})
    matrix->setZero();
  for (std::size_t b = 0; b < system.bodies.size(); ++b) {
    const Index i = system.first_coordinate[b], n = system.bodies[b].coordinates();
    tangent(system.bodies[b], w.bodies[b], q + i, v + i, a + i, system.gravity, result.M.block(i, i, n, n),
            result.D.block(i, i, n, n), result.K.block(i, i, n, n));
  }
  for (std::size_t d = 0; d < system.drives.size(); ++d) {
    const Drive &drive = system.drives[d];
    add_row_curvature(system, drive.row, -(drive.magnitude(t).value + w.external_drive[d]), w, result.K);
  }
  if (!system.rotors.empty() ||
      std::any_of(system.drives.begin(), system.drives.end(), [](const Drive &d) { return d.friction.acts(); }))
    add_built_joints(system, q, v, a, w, result);
  for (const StateForce &force : system.state_forces)
    add_state_force(system, force, t, q, v, a, w, result);
  add_springs(system, w, result);
}

} // namespace ffrobot
