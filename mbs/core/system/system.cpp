#include "core/system/system.h"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace ffrobot {

using Eigen::Index;

void System::finish() {
  first_coordinate.clear();
  Index coordinates = 0;
  length = 0;
  for (const auto &body : bodies) {
    first_coordinate.push_back(coordinates);
    coordinates += body.coordinates();
    length = std::max(length, std::sqrt(body.inertia / body.mass)); // markers may all lie at the origin
    for (const auto &position : body.marker_positions)
      length = std::max(length, position.norm());
  }
  space = ConfigurationSpace(coordinates);
  rows.clear();
  for (const Constraint &constraint : constraints)
    rows.push_back(constraint.row);
  for (const Rotor &rotor : rotors)
    rows.push_back(rotor.row);
  find_used_markers();
  find_couplings();
}

Index System::n_modes() const {
  Index modes = 0;
  for (const auto &body : bodies)
    modes += body.modes();
  return modes;
}

void System::find_used_markers() {
  for (auto &body : bodies)
    body.marker_rows.assign(static_cast<std::size_t>(body.markers()), 0);
  for (const Measure &row : rows)
    for (const auto *m : {&row.a, &row.b})
      if (m->body >= 0) {
        int &used = bodies[static_cast<std::size_t>(m->body)].marker_rows[static_cast<std::size_t>(m->marker)];
        used = std::max(used, row.kind == MeasureKind::x || row.kind == MeasureKind::y ? 2 : 3);
      }
}

void System::find_couplings() {
  couplings.clear();
  envelope.clear();
  const auto count = static_cast<int>(rows.size());
  for (int r = 0; r < count; ++r) {
    const Measure &row = rows[static_cast<std::size_t>(r)];
    Index first = r;
    for (int s = 0; s <= r; ++s) {
      const Measure &other = rows[static_cast<std::size_t>(s)];
      for (const bool r_is_b : {false, true})
        for (const bool s_is_b : {false, true}) {
          const MarkerReference &m = r_is_b ? row.b : row.a, &o = s_is_b ? other.b : other.a;
          if (m.body < 0 || m.body != o.body)
            continue;
          couplings.push_back({r, s, m.body, m.marker, o.marker, r_is_b, s_is_b});
          first = std::min<Index>(first, s);
        }
    }
    envelope.push_back(first);
  }
  const auto block = [](const Coupling &c) { return std::tuple(c.body, c.k, c.l); };
  std::ranges::stable_sort(couplings, {}, block); // those between the same two markers one after the other
}

Workspace::Workspace(const System &system)
    : bodies(system.bodies.begin(), system.bodies.end()), rows(system.rows.size()), drive_rows(system.drives.size()),
      targets(system.rows.size()), external_drive(system.drives.size(), 0.0), schur(system.envelope),
      ports(bodies, system.rows, schur), lambda(Eigen::VectorXd::Zero(static_cast<Index>(system.rows.size()))),
      correction(Eigen::VectorXd::Zero(system.n_v())), value(lambda), rate(lambda) {
  for (const auto &body : system.bodies) {
    wrench.emplace_back(Eigen::Matrix3Xd::Zero(3, body.markers()));
    external_modal.emplace_back(Eigen::VectorXd::Zero(body.modes()));
  }
  for (std::size_t r = 0; r < rows.size(); ++r)
    evaluate(system.rows[r], bodies, rows[r]);
}

void update_kinematics(const System &system, const double *q, const double *v, Workspace &w) {
  for (std::size_t b = 0; b < system.bodies.size(); ++b) {
    const Index i = system.first_coordinate[b];
    kinematics(system.bodies[b], q + i, v + i, w.bodies[b]);
  }
}

namespace {

// The stages of a step and its projection meet the same time again and again.
void update_targets(const System &system, double t, Workspace &w) {
  if (t == w.target_time)
    return;
  for (std::size_t r = 0; r < system.n_bilateral(); ++r)
    w.targets[r] = system.constraints[r].target(t);
  w.target_time = t;
}

void apply_drives(const System &system, double t, Workspace &w) {
  if (!system.drives.empty() || !system.springs.empty() || !system.state_forces.empty()) {
    for (std::size_t b = 0; b < system.bodies.size(); ++b) {
      w.wrench[b].setZero();
      w.bodies[b].has_wrench = true;
    }
    for (std::size_t d = 0; d < system.drives.size(); ++d) {
      const Drive &drive = system.drives[d];
      evaluate(drive.row, w.bodies, w.drive_rows[d]);
      double force = drive.magnitude(t).value + w.external_drive[d];
      if (drive.friction.acts())
        force -= drive.friction.resistance(w.drive_rows[d].rate);
      add_wrench(drive.row, w.drive_rows[d], force, w.wrench);
    }
    for (const StateForce &force : system.state_forces)
      w.wrench[static_cast<std::size_t>(force.marker.body)].col(force.marker.marker) += force(t, w.bodies);
    MeasureMotion motor, joint;
    for (const Spring &spring : system.springs) {
      evaluate(spring.motor, w.bodies, motor);
      evaluate(spring.joint, w.bodies, joint);
      const double moment = spring.moment(motor, joint);
      add_wrench(spring.motor, motor, -moment, w.wrench);
      add_wrench(spring.joint, joint, moment, w.wrench);
    }
    for (std::size_t b = 0; b < system.bodies.size(); ++b)
      w.bodies[b].wrench = w.wrench[b];
  }
  if (!system.modal_drives.empty() || w.has_external_modal) {
    for (std::size_t b = 0; b < system.bodies.size(); ++b) {
      w.bodies[b].modal_load = w.external_modal[b];
      w.bodies[b].has_modal_load = true;
    }
    for (const ModalDrive &drive : system.modal_drives)
      w.bodies[static_cast<std::size_t>(drive.body)].modal_load += drive.magnitude(t).value * drive.vector;
  }
}

// w.lambda <- (C M^-1 C^T)^-1 w.lambda, and its forces -C^T lambda on the ports
void solve_multipliers(Workspace &w) {
  w.schur.solve(w.lambda.data());
  w.ports.set_forces(w.lambda.data(), w.bodies);
}

void assemble_schur(const System &system, Workspace &w) {
  w.schur.set_zero();
  w.ports.assemble(w.bodies, w.schur);
  auto i = static_cast<Index>(system.n_bilateral());
  for (const Rotor &rotor : system.rotors) {
    *w.schur.entry(i, i) += rotor.compliance;
    ++i;
  }
  w.schur.factorise();
}

// Everything of an evaluation that does not depend on what the constraints ask for: C M^-1 C^T is factorised after it.
void eliminate(const System &system, double t, const double *q, const double *v, Workspace &w) {
  update_kinematics(system, q, v, w);
  apply_drives(system, t, w);
  for (std::size_t b = 0; b < system.bodies.size(); ++b) {
    const Index i = system.first_coordinate[b];
    free_motion(system.bodies[b], q + i, v + i, system.gravity, w.bodies[b]);
  }
  for (const std::size_t r : w.ports.moving_rows())
    evaluate(system.rows[r], w.bodies, w.rows[r]);
  w.ports.update(w.rows);
  update_targets(system, t, w);
  assemble_schur(system, w);
}

} // namespace

void accelerations(const System &system, double t, const double *q, const double *v, Workspace &w, double *a) {
  ++w.evaluations;
  eliminate(system, t, q, v, w);
  for (std::size_t r = 0; r < w.rows.size(); ++r)
    w.lambda[static_cast<Index>(r)] = w.rows[r].bias - w.targets[r].acceleration;
  w.ports.add_accelerations(w.bodies, w.lambda.data());
  solve_multipliers(w);
  for (std::size_t b = 0; b < system.bodies.size(); ++b) {
    const Index i = system.first_coordinate[b];
    accelerations(system.bodies[b], q + i, w.bodies[b], a + i);
  }
}

void constraint_residuals(const System &system, double t, const double *q, const double *v, Workspace &w, double *value,
                          double *rate) {
  update_kinematics(system, q, v, w);
  update_targets(system, t, w);
  MeasureMotion motion;
  for (std::size_t r = 0; r < system.n_bilateral(); ++r) {
    evaluate(system.rows[r], w.bodies, motion);
    value[r] = motion.value - w.targets[r].value;
    rate[r] = motion.rate - w.targets[r].rate;
  }
  std::fill(value + system.n_bilateral(), value + system.rows.size(), 0.0);
  std::fill(rate + system.n_bilateral(), rate + system.rows.size(), 0.0);
}

double acceleration_residual(const System &system, const double *q, const double *a, const Workspace &w) {
  double worst = 0;
  MeasureMotion motion;
  for (std::size_t r = 0; r < system.n_bilateral(); ++r) {
    const Measure &row = system.rows[r];
    evaluate(row, w.bodies, motion);
    double residual = motion.bias - w.targets[r].acceleration, scale = 1 + std::abs(w.targets[r].acceleration);
    for (const auto &[m, c] : {std::pair(&row.b, &motion.coefficient_b), std::pair(&row.a, &motion.coefficient_a)}) {
      if (m->body < 0)
        continue;
      const auto b = static_cast<std::size_t>(m->body);
      double size = 0;
      residual += c->dot(marker_acceleration(system.bodies[b], w.bodies[b], m->marker, q + system.first_coordinate[b],
                                             a + system.first_coordinate[b], size));
      scale += c->lpNorm<Eigen::Infinity>() * size;
    }
    worst = std::max(worst, std::abs(residual) / scale);
  }
  return worst;
}

void static_force(const System &system, double t, const double *q, Workspace &w, double *Q) {
  w.correction.setZero();
  update_kinematics(system, q, w.correction.data(), w);
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

double row_acceleration(const System &system, const Measure &row, const MeasureMotion &motion, const double *q,
                        const double *a, const Workspace &w) {
  double acceleration = motion.bias;
  for (const auto &[m, coefficient] :
       {std::pair(&row.b, &motion.coefficient_b), std::pair(&row.a, &motion.coefficient_a)}) {
    if (m->body < 0)
      continue;
    const auto b = static_cast<std::size_t>(m->body);
    const Index i = system.first_coordinate[b];
    double size = 0;
    acceleration += coefficient->dot(marker_acceleration(system.bodies[b], w.bodies[b], m->marker, q + i, a + i, size));
  }
  return acceleration;
}

void constraint_accelerations(const System &system, const double *q, const double *a, const Workspace &w, double *c) {
  for (std::size_t r = 0; r < system.rows.size(); ++r)
    c[r] = row_acceleration(system, system.rows[r], w.rows[r], q, a, w) - w.targets[r].acceleration;
}

double project(const System &system, double t, double *q, double *v, Workspace &w) {
  // Not tighter: rounding of positions, moved into modes with frequencies up to 1e5 rad/s, is noise in their forces.
  constexpr double tolerance = 1e-12;
  constexpr int refresh_after = 3, most_iterations = 12;
  if (system.rows.empty())
    return 0;
  const Eigen::Map<Eigen::VectorXd> q_(q, system.n_q()), v_(v, system.n_v());
  Eigen::VectorXd &value = w.value, &rate = w.rate;
  const auto find_correction = [&](const Eigen::VectorXd &residual) {
    w.lambda = residual;
    solve_multipliers(w);
    for (std::size_t b = 0; b < system.bodies.size(); ++b)
      apply_inverse_mass(system.bodies[b], w.bodies[b], w.correction.data() + system.first_coordinate[b]);
  };
  double left = 0, previous = 1e300;
  for (int i = 0; i < most_iterations; ++i) {
    constraint_residuals(system, t, q, v, w, value.data(), rate.data());
    const double position = value.lpNorm<Eigen::Infinity>(), velocity = rate.lpNorm<Eigen::Infinity>();
    const double scale_q = 1 + q_.lpNorm<Eigen::Infinity>(), scale_v = 1 + v_.lpNorm<Eigen::Infinity>();
    left = std::max(position / scale_q, velocity / scale_v);
    if (!(left > tolerance) || (left < 1e-11 && left > 0.2 * previous)) // done, at the rounding floor, or NaN
      break;
    previous = left;
    if (i >= refresh_after)
      eliminate(system, t, q, v, w);
    find_correction(rate);
    Eigen::Map<Eigen::VectorXd>(v, system.n_v()) += w.correction;
    if (position > tolerance * scale_q) {
      find_correction(value);
      system.space.integrate(q, 1, w.correction.data(), q);
    }
  }
  return left;
}

Eigen::MatrixXd constraint_jacobian(const System &system, const Workspace &w) {
  const auto m = static_cast<Index>(system.n_bilateral());
  Eigen::MatrixXd C_q = Eigen::MatrixXd::Zero(system.n_v(), m); // transposed: gradients are columns
  for (std::size_t r = 0; r < system.n_bilateral(); ++r) {
    MeasureMotion motion;
    evaluate(system.rows[r], w.bodies, motion);
    jacobian(system.rows[r], motion, system.bodies, w.bodies, system.first_coordinate, C_q.col(static_cast<Index>(r)));
  }
  return C_q.transpose();
}

JointEnergy joint_energy(const System &system, const double *q, const double *v, Workspace &w) {
  update_kinematics(system, q, v, w);
  JointEnergy result;
  MeasureMotion motion;
  for (const Rotor &rotor : system.rotors) {
    evaluate(rotor.row, w.bodies, motion);
    result.kinetic += motion.rate * motion.rate / (2 * rotor.compliance);
  }
  for (const Drive &drive : system.drives)
    if (drive.friction.acts()) {
      evaluate(drive.row, w.bodies, motion);
      result.dissipated_power += drive.friction.resistance(motion.rate) * motion.rate;
    }
  MeasureMotion of_joint;
  for (const Spring &spring : system.springs) {
    evaluate(spring.motor, w.bodies, motion);
    evaluate(spring.joint, w.bodies, of_joint);
    const double twist = motion.value - of_joint.value, rate = motion.rate - of_joint.rate;
    result.strain += 0.5 * spring.stiffness * twist * twist;
    result.dissipated_power += spring.damping * rate * rate;
  }
  return result;
}

} // namespace ffrobot
