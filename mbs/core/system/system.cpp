#include "core/system/system.h"

#include <algorithm>
#include <cmath>

namespace ffrobot {

using Eigen::Index;

void System::finish() {
  first_coordinate.clear();
  coordinates = 0;
  length = 0;
  for (const auto &body : bodies) {
    first_coordinate.push_back(coordinates);
    coordinates += body.coordinates();
    length = std::max(length, std::sqrt(body.inertia / body.mass)); // markers may all lie at the origin
    for (const auto &position : body.marker_positions)
      length = std::max(length, position.norm());
  }
}

Index System::n_modes() const {
  Index modes = 0;
  for (const auto &body : bodies)
    modes += body.modes();
  return modes;
}

Workspace::Workspace(const System &system) : bodies(system.bodies.begin(), system.bodies.end()) {
  for (const auto &body : system.bodies)
    wrench.emplace_back(Eigen::Matrix3Xd::Zero(3, body.markers()));
}

void update_kinematics(const System &system, const double *q, const double *v, Workspace &w) {
  for (std::size_t b = 0; b < system.bodies.size(); ++b) {
    const Index i = system.first_coordinate[b];
    kinematics(system.bodies[b], q + i, v + i, w.bodies[b]);
  }
}

namespace {

void add_springs(const System &system, Workspace &w) {
  MeasureMotion motor, joint;
  for (const Spring &spring : system.springs) {
    evaluate(spring.motor, w.bodies, motor);
    evaluate(spring.joint, w.bodies, joint);
    const double moment = spring.moment(motor, joint);
    add_wrench(spring.motor, motor, -moment, w.wrench);
    add_wrench(spring.joint, joint, moment, w.wrench);
  }
}

void apply_drives(const System &system, double t, Workspace &w) {
  for (auto &on_body : w.wrench)
    on_body.setZero();
  MeasureMotion motion;
  for (const Drive &drive : system.drives) {
    evaluate(drive.row, w.bodies, motion);
    double force = drive.magnitude(t).value;
    if (drive.friction.acts())
      force -= drive.friction.resistance(motion.rate);
    add_wrench(drive.row, motion, force, w.wrench);
  }
  for (const StateForce &force : system.state_forces)
    w.wrench[static_cast<std::size_t>(force.marker.body)].col(force.marker.marker) += force(t, w.bodies);
  add_springs(system, w);
  for (std::size_t b = 0; b < system.bodies.size(); ++b) {
    w.bodies[b].wrench = w.wrench[b];
    w.bodies[b].modal_load.setZero();
  }
  for (const ModalDrive &drive : system.modal_drives)
    w.bodies[static_cast<std::size_t>(drive.body)].modal_load += drive.magnitude(t).value * drive.vector;
}

} // namespace

void constraint_residuals(const System &system, double t, const double *q, const double *v, Workspace &w, double *value,
                          double *rate) {
  update_kinematics(system, q, v, w);
  MeasureMotion motion;
  for (std::size_t r = 0; r < system.constraints.size(); ++r) {
    const Jet target = system.constraints[r].target(t);
    evaluate(system.constraints[r].row, w.bodies, motion);
    value[r] = motion.value - target.value;
    rate[r] = motion.rate - target.rate;
  }
}

Eigen::MatrixXd constraint_jacobian(const System &system, const Workspace &w) {
  const auto m = static_cast<Index>(system.constraints.size());
  Eigen::MatrixXd C_q = Eigen::MatrixXd::Zero(system.coordinates, m); // transposed: gradients are columns
  MeasureMotion motion;
  for (Index r = 0; r < m; ++r) {
    const Measure &row = system.constraints[static_cast<std::size_t>(r)].row;
    evaluate(row, w.bodies, motion);
    jacobian(row, motion, system.bodies, w.bodies, system.first_coordinate, C_q.col(r));
  }
  return C_q.transpose();
}

double row_acceleration(const System &system, const Measure &row, const MeasureMotion &motion, const double *a,
                        const Workspace &w) {
  double acceleration = motion.bias;
  for (const auto &[m, coefficient] :
       {std::pair(&row.b, &motion.coefficient_b), std::pair(&row.a, &motion.coefficient_a)}) {
    if (m->body < 0)
      continue;
    const auto b = static_cast<std::size_t>(m->body);
    acceleration +=
        coefficient->dot(marker_acceleration(system.bodies[b], w.bodies[b], m->marker, a + system.first_coordinate[b]));
  }
  return acceleration;
}

void static_force(const System &system, double t, const double *q, Workspace &w, double *Q) {
  const Eigen::VectorXd rest = Eigen::VectorXd::Zero(system.coordinates);
  update_kinematics(system, q, rest.data(), w);
  apply_drives(system, t, w);
  for (std::size_t b = 0; b < system.bodies.size(); ++b) {
    const Index i = system.first_coordinate[b];
    static_force(system.bodies[b], q + i, system.gravity, w.bodies[b], Q + i);
  }
}

void required_force(const System &system, double t, const double *q, const double *v, const double *a, Workspace &w,
                    double *f) {
  update_kinematics(system, q, v, w);
  apply_drives(system, t, w);
  for (std::size_t b = 0; b < system.bodies.size(); ++b) {
    const Index i = system.first_coordinate[b];
    required_force(system.bodies[b], q + i, v + i, a + i, system.gravity, w.bodies[b], f + i);
  }
}

} // namespace ffrobot
