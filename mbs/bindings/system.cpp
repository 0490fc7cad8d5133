#include "core/system/system.h"
#include "core/system/motion.h"

#include <cstdint>
#include <functional>
#include <tuple>

#include <nanobind/eigen/dense.h>
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/function.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include "bindings/bindings.h"

namespace nb = nanobind;
using namespace nb::literals;
using namespace ffrobot;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::VectorXd;
using RowMajorMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

namespace {

PlanarBody make_body(double mass, double inertia, const Vector2d &first_moment, const VectorXd &stiffness,
                     const MatrixXd &damping, const MatrixXd &W, const VectorXd &j, const MatrixXd &S_tilde,
                     const MatrixXd &m_xy, const std::vector<Vector2d> &marker_positions,
                     const std::vector<MatrixXd> &second_order, const MatrixXd &K_omega) {
  const auto n = stiffness.size();
  check_size("W rows", W.rows(), 3 + 3 * static_cast<Eigen::Index>(marker_positions.size()));
  check_size("W columns", W.cols(), n);
  for (const auto &[name, size] :
       {std::pair("damping", damping.rows()), {"j", j.size()}, {"S_tilde", S_tilde.rows()}, {"m_xy", m_xy.rows()}})
    if (size)
      check_size(name, size, n);
  PlanarBody body{mass,    inertia, first_moment,     stiffness, damping, W,      j,
                  S_tilde, m_xy,    marker_positions, {},        {},      K_omega};
  for (std::size_t row = 0; row < second_order.size(); ++row)
    if (second_order[row].size()) {
      check_size("second_order", second_order[row].rows(), n);
      body.second_order.push_back({static_cast<Eigen::Index>(row), second_order[row]});
    }
  return body;
}

// (a, lambda) at one state; steering may be null
std::tuple<VectorXd, VectorXd> evaluate_state(const System &system, double t, const VectorXd &q, const VectorXd &v,
                                              ExternalLoads *steering) {
  check_size("q", q.size(), system.coordinates);
  check_size("v", v.size(), system.coordinates);
  Workspace w(system);
  VectorXd a(system.coordinates);
  if (steering)
    steering->steer(t, w);
  accelerations(system, t, q.data(), v.data(), w, a.data());
  return {a, w.lambda.head(static_cast<Eigen::Index>(system.held))};
}

// (C, C_dot, C_q) at one state
std::tuple<VectorXd, VectorXd, MatrixXd> constraints(const System &system, double t, const VectorXd &q,
                                                     const VectorXd &v) {
  check_size("q", q.size(), system.coordinates);
  check_size("v", v.size(), system.coordinates);
  Workspace w(system);
  const auto m = static_cast<Eigen::Index>(system.constraints.size());
  VectorXd value(m), rate(m);
  constraint_residuals(system, t, q.data(), v.data(), w, value.data(), rate.data());
  const auto held = static_cast<Eigen::Index>(system.held);
  return {value.head(held), rate.head(held), constraint_jacobian(system, w)};
}

// How far the accelerations a are from C_ddot = 0, relative to the terms that cancel in it
double acceleration_violation(const System &system, double t, const VectorXd &q, const VectorXd &v, const VectorXd &a) {
  for (const auto &[name, size] : {std::pair("q", q.size()), std::pair("v", v.size()), std::pair("a", a.size())})
    check_size(name, size, system.coordinates);
  Workspace w(system);
  VectorXd value(static_cast<Eigen::Index>(system.constraints.size())), rate(value);
  constraint_residuals(system, t, q.data(), v.data(), w, value.data(), rate.data());
  return acceleration_residual(system, q.data(), a.data(), w);
}

// x of N x + C_q^T nu = r, C_q x = c (iteration_matrix.h)
VectorXd newton_step(const System &system, double t, const VectorXd &q, const VectorXd &v, double damping_factor,
                     double stiffness_factor, const VectorXd &r, const VectorXd &c) {
  VectorXd x(system.coordinates), y(2 * system.coordinates), slope(y.size());
  y << q, v;
  check_size("y", y.size(), slope.size());
  check_size("r", r.size(), x.size());
  check_size("c", c.size(), static_cast<Eigen::Index>(system.held));
  VectorXd all = VectorXd::Zero(static_cast<Eigen::Index>(system.constraints.size())); // nothing holds rotors
  all.head(c.size()) = c;
  ConstrainedMotion motion(system, {}, {}, nullptr);
  motion.slope(t, y.data(), slope.data());
  motion.factorise(damping_factor, stiffness_factor);
  motion.solve(r.data(), all.data(), x.data());
  return x;
}

std::tuple<MatrixXd, VectorXd> rotor_rows(const System &system, const VectorXd &q) {
  check_size("q", q.size(), system.coordinates);
  Workspace w(system);
  const VectorXd rest = VectorXd::Zero(q.size());
  joint_energy(system, q.data(), rest.data(), w);
  const auto count = static_cast<Eigen::Index>(system.constraints.size() - system.held);
  MatrixXd gradients = MatrixXd::Zero(q.size(), count);
  VectorXd inertia(count);
  MeasureMotion motion;
  for (Eigen::Index k = 0; k < count; ++k) {
    const Constraint &rotor = system.constraints[system.held + static_cast<std::size_t>(k)];
    evaluate(rotor.row, w.bodies, motion);
    jacobian(rotor.row, motion, system.bodies, w.bodies, system.first_coordinate, gradients.col(k));
    inertia[k] = 1 / rotor.compliance;
  }
  return {gradients.transpose(), inertia};
}

VectorXd force_at_rest(const System &system, double t, const VectorXd &q) {
  check_size("q", q.size(), system.coordinates);
  Workspace w(system);
  VectorXd Q(system.coordinates);
  static_force(system, t, q.data(), w, Q.data());
  return Q;
}

// (kinetic, strain, gravitational, dissipated power) of the system, one row per state
MatrixXd energies(const System &system, const MatrixXd &q, const MatrixXd &v) {
  check_size("q columns", q.cols(), system.coordinates);
  MatrixXd result = MatrixXd::Zero(q.rows(), 4);
  Workspace w(system);
  for (Eigen::Index i = 0; i < q.rows(); ++i) {
    const VectorXd q_i = q.row(i), v_i = v.row(i);
    for (std::size_t b = 0; b < system.bodies.size(); ++b) {
      const auto first = system.first_coordinate[b];
      const Energy e = energy(system.bodies[b], q_i.data() + first, v_i.data() + first, system.gravity);
      result.row(i) += Eigen::RowVector4d(e.kinetic, e.strain, e.gravitational, e.dissipated_power);
    }
    const JointEnergy e = joint_energy(system, q_i.data(), v_i.data(), w);
    result(i, 0) += e.kinetic;
    result(i, 1) += e.strain;
    result(i, 3) += e.dissipated_power;
  }
  return result;
}

using Samples = nb::ndarray<nb::numpy, double, nb::ndim<3>>;

// C_q (T, constraints, coordinates) at the coordinates q (T, coordinates)
Samples constraint_jacobians(const System &system, const RowMajorMatrix &q) {
  check_size("q columns", q.cols(), system.coordinates);
  Workspace w(system);
  const auto T = static_cast<std::size_t>(q.rows()), m = system.held;
  const auto n = static_cast<std::size_t>(system.coordinates);
  auto *data = new double[T * m * n];
  nb::capsule owner(data, [](void *p) noexcept { delete[] static_cast<double *>(p); });
  const VectorXd rest = VectorXd::Zero(system.coordinates);
  VectorXd value(static_cast<Eigen::Index>(system.constraints.size())), rate(value);
  for (std::size_t i = 0; i < T; ++i) {
    const VectorXd q_i = q.row(static_cast<Eigen::Index>(i)).transpose();
    constraint_residuals(system, 0.0, q_i.data(), rest.data(), w, value.data(), rate.data());
    Eigen::Map<RowMajorMatrix>(data + i * m * n, static_cast<Eigen::Index>(m), system.coordinates) =
        constraint_jacobian(system, w);
  }
  return Samples(data, {T, m, n}, owner);
}

StateFunction python_force(
    const std::function<std::tuple<double, double, double>(double, double, double, double, double)> &function) {
  return {[function](double t, const double *position, const double *rate, double *force) {
    std::tie(force[0], force[1], force[2]) = function(t, position[0], position[1], rate[0], rate[1]);
  }};
}

} // namespace

void bind_system(nb::module_ &m) {
  nb::class_<MarkerReference>(m, "Marker", "A marker of a body (body index, marker index), or a point of the ground.")
      .def(nb::init<int, int, Vector2d>(), "body"_a, "marker"_a, "ground"_a)
      .def_ro("body", &MarkerReference::body)
      .def_ro("marker", &MarkerReference::marker);
  nb::enum_<MeasureKind>(m, "MeasureKind", "What a row measures between its two markers.")
      .value("x", MeasureKind::x)
      .value("y", MeasureKind::y)
      .value("angle", MeasureKind::angle)
      .value("slide", MeasureKind::slide)
      .value("gear", MeasureKind::gear);
  nb::class_<Measure>(m, "Measure", "A scalar function of the motion of two markers: that of b relative to a.")
      .def(nb::init<MeasureKind, MarkerReference, MarkerReference, Vector2d, double>(), "kind"_a, "a"_a, "b"_a,
           "direction"_a, "offset"_a)
      .def_ro("kind", &Measure::kind)
      .def_ro("a", &Measure::a)
      .def_ro("b", &Measure::b);

  nb::class_<StateFunction>(m, "StateFunction", "A force of the user's, of time, position and velocity.")
      .def_static("python", &python_force, "function"_a, "A callable of t, x, y, v_x, v_y that returns (x, y, moment).")
      .def_static(
          "compiled",
          [](std::uintptr_t address) { return StateFunction{reinterpret_cast<StateFunction::Compiled>(address)}; },
          "address"_a,
          "Address of a C function void(double t, const double *x_y_angle, const double *rates, double *x_y_moment).");

  nb::class_<System>(m, "System", "Bodies, constraints and drives; call finish() once after adding them.")
      .def(
          "__init__", [](System *s, const Vector2d &gravity) { (new (s) System())->gravity = gravity; }, "gravity"_a)
      .def(
          "add_body",
          [](System &s, double mass, double inertia, const Vector2d &first_moment, const VectorXd &stiffness,
             const MatrixXd &damping, const MatrixXd &W, const VectorXd &j, const MatrixXd &S_tilde,
             const MatrixXd &m_xy, const std::vector<Vector2d> &marker_positions,
             const std::vector<MatrixXd> &second_order, const MatrixXd &K_omega) {
            s.bodies.push_back(make_body(mass, inertia, first_moment, stiffness, damping, W, j, S_tilde, m_xy,
                                         marker_positions, second_order, K_omega));
          },
          "mass"_a, "inertia"_a, "first_moment"_a, "stiffness"_a, "damping"_a, "W"_a, "j"_a, "S_tilde"_a, "m_xy"_a,
          "marker_positions"_a, "second_order"_a, "K_omega"_a)
      .def(
          "add_constraint",
          [](System &s, const Measure &row, const TimeFunction &f) { s.constraints.push_back({row, f}); }, "row"_a,
          "target"_a)
      .def(
          "add_rotor",
          [](System &s, const Measure &row, double inertia) {
            s.constraints.push_back({row, Constant(0.0), 1 / inertia});
          },
          "row"_a, "inertia"_a, "After all constraints.")
      .def(
          "add_friction",
          [](System &s, const Measure &row, double viscous, double coulomb, double speed) {
            s.drives.push_back({row, Constant(0.0), {viscous, coulomb, speed}});
          },
          "row"_a, "viscous"_a, "coulomb"_a, "speed"_a)
      .def(
          "add_spring",
          [](System &s, const Measure &motor, const Measure &joint, double stiffness, double damping) {
            s.springs.push_back({motor, joint, stiffness, damping});
          },
          "motor"_a, "joint"_a, "stiffness"_a, "damping"_a)
      .def(
          "add_drive", [](System &s, const Measure &row, const TimeFunction &f) { s.drives.push_back({row, f}); },
          "row"_a, "size"_a)
      .def(
          "add_modal_drive",
          [](System &s, int body, const VectorXd &vector, const TimeFunction &f) {
            s.modal_drives.push_back({body, vector, f});
          },
          "body"_a, "vector"_a, "size"_a)
      .def(
          "add_state_force",
          [](System &s, const MarkerReference &marker, const StateFunction &function) {
            s.state_forces.push_back({marker, function});
          },
          "marker"_a, "function"_a)
      .def("finish", &System::finish)
      .def_ro("coordinates", &System::coordinates)
      .def_ro("length", &System::length)
      .def_ro("first_coordinate", &System::first_coordinate)
      .def("evaluate", &evaluate_state, "t"_a, "q"_a, "v"_a, "steering"_a = nb::none(),
           "Accelerations (coordinates,) and multipliers (constraints,).")
      .def("constraints", &constraints, "t"_a, "q"_a, "v"_a, "C, C_dot (constraints,) and C_q.")
      .def("acceleration_violation", &acceleration_violation, "t"_a, "q"_a, "v"_a, "a"_a,
           "The largest |C_ddot| for accelerations a (coordinates,), relative to 1 and the terms that cancel in it.")
      .def("constraint_jacobians", &constraint_jacobians, "q"_a, "C_q (T, constraints, coordinates).")
      .def("rotor_rows", &rotor_rows, "q"_a, "Gradients (rotors, coordinates) of the rotors' angles and inertias.")
      .def("force_at_rest", &force_at_rest, "t"_a, "q"_a, "Generalized forces of gravity, elasticity and drives.")
      .def("newton_step", &newton_step, "t"_a, "q"_a, "v"_a, "damping_factor"_a, "stiffness_factor"_a, "r"_a, "c"_a,
           "x of (M + damping_factor D + stiffness_factor K) x + C_q^T nu = r, C_q x = c; r on modes alone.")
      .def("energies", &energies, "q"_a, "v"_a, "Kinetic, strain, gravitational energy and dissipated power (T, 4).");

  m.def(
      "time_evaluations",
      [](const System &system, double t, const VectorXd &q, const VectorXd &v, int repetitions) {
        Workspace w(system);
        VectorXd a(system.coordinates);
        for (int i = 0; i < repetitions; ++i)
          accelerations(system, t, q.data(), v.data(), w, a.data());
        return a[0];
      },
      "system"_a, "t"_a, "q"_a, "v"_a, "repetitions"_a, "Evaluates the accelerations many times, for benchmarks.");
}
