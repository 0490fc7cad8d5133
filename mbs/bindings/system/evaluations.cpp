#include "core/system/motion.h"

#include <optional>
#include <tuple>
#include <utility>
#include <vector>

#include <nanobind/eigen/dense.h>
#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include "bindings/bindings.h"
#include "bindings/system/system.h"

namespace nb = nanobind;
using namespace nb::literals;
using namespace ffrobot;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using RowMajorMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

namespace {

// (a, lambda) at one state; external_loads may be null
std::tuple<VectorXd, VectorXd> evaluate_state(const System &system, double t, const VectorXd &q, const VectorXd &v,
                                              ExternalLoads *external_loads) {
  check_size("q", q.size(), system.n_q());
  check_size("v", v.size(), system.n_v());
  Workspace w(system);
  VectorXd a(system.n_v());
  if (external_loads)
    external_loads->apply(t, w);
  accelerations(system, t, q.data(), v.data(), w, a.data());
  return {a, w.lambda.head(static_cast<Eigen::Index>(system.n_bilateral()))};
}

// (C, C_dot, C_q) at one state
std::tuple<VectorXd, VectorXd, MatrixXd> constraints(const System &system, double t, const VectorXd &q,
                                                     const VectorXd &v) {
  check_size("q", q.size(), system.n_q());
  check_size("v", v.size(), system.n_v());
  Workspace w(system);
  VectorXd value(static_cast<Eigen::Index>(system.rows.size())), rate(value);
  constraint_residuals(system, t, q.data(), v.data(), w, value.data(), rate.data());
  const auto m = static_cast<Eigen::Index>(system.n_bilateral());
  return {value.head(m), rate.head(m), constraint_jacobian(system, w)};
}

// How far the accelerations a are from C_ddot = 0, relative to the terms that cancel in it
double acceleration_violation(const System &system, double t, const VectorXd &q, const VectorXd &v, const VectorXd &a) {
  check_size("q", q.size(), system.n_q());
  check_size("v", v.size(), system.n_v());
  check_size("a", a.size(), system.n_v());
  Workspace w(system);
  VectorXd value(static_cast<Eigen::Index>(system.rows.size())), rate(value);
  constraint_residuals(system, t, q.data(), v.data(), w, value.data(), rate.data());
  return acceleration_residual(system, q.data(), a.data(), w);
}

// (C_q rows of the rotors' angles, their inertias)
std::tuple<MatrixXd, VectorXd> rotor_rows(const System &system, const VectorXd &q) {
  check_size("q", q.size(), system.n_q());
  Workspace w(system);
  const VectorXd rest = VectorXd::Zero(system.n_v());
  update_kinematics(system, q.data(), rest.data(), w);
  const auto count = static_cast<Eigen::Index>(system.rotors.size());
  MatrixXd gradients = MatrixXd::Zero(system.n_v(), count);
  VectorXd inertia(count);
  MeasureMotion motion;
  for (Eigen::Index k = 0; k < count; ++k) {
    const Rotor &rotor = system.rotors[static_cast<std::size_t>(k)];
    evaluate(rotor.row, w.bodies, motion);
    jacobian(rotor.row, motion, system.bodies, w.bodies, system.first_coordinate, gradients.col(k));
    inertia[k] = 1 / rotor.compliance;
  }
  return {gradients.transpose(), inertia};
}

VectorXd force_at_rest(const System &system, double t, const VectorXd &q) {
  check_size("q", q.size(), system.n_q());
  Workspace w(system);
  VectorXd Q(system.n_v());
  static_force(system, t, q.data(), w, Q.data());
  return Q;
}

void check_motions(const System &system, const VectorXd &times, const RowMajorMatrix &q, const RowMajorMatrix &v,
                   const RowMajorMatrix &a) {
  check_size("q columns", q.cols(), system.n_q());
  check_size("v columns", v.cols(), system.n_v());
  check_size("a columns", a.cols(), system.n_v());
  for (const RowMajorMatrix *values : {&q, &v, &a})
    check_size("rows of q, v and a", values->rows(), times.size());
}

// f = M a - Q of state i, with the inertia of rotors; leaves kinematics and the wrenches of drives in w.
void force_at(const System &system, double t, const VectorXd &q, const VectorXd &v, const VectorXd &a, Workspace &w,
              VectorXd &f, std::vector<Eigen::Matrix3Xd> &wrench) {
  required_force(system, t, q.data(), v.data(), a.data(), w, f.data());
  wrench = w.wrench;
  MeasureMotion motion;
  VectorXd gradient(system.n_v());
  for (const Rotor &rotor : system.rotors) {
    evaluate(rotor.row, w.bodies, motion);
    const double force = row_acceleration(system, rotor.row, motion, q.data(), a.data(), w) / rotor.compliance;
    gradient.setZero();
    jacobian(rotor.row, motion, system.bodies, w.bodies, system.first_coordinate, gradient);
    f += force * gradient;
    add_wrench(rotor.row, motion, -force, wrench);
  }
}

// f (T, n_v) of motions, beside forces `pulls` along measures
RowMajorMatrix required_forces(const System &system, const VectorXd &times, const RowMajorMatrix &q,
                               const RowMajorMatrix &v, const RowMajorMatrix &a,
                               const std::optional<std::vector<std::pair<Measure, double>>> &pulls) {
  check_motions(system, times, q, v, a);
  Workspace w(system);
  RowMajorMatrix result(times.size(), system.n_v());
  VectorXd f(system.n_v());
  std::vector<Eigen::Matrix3Xd> wrench;
  MeasureMotion motion;
  const auto along = pulls.value_or(std::vector<std::pair<Measure, double>>{});
  for (Eigen::Index i = 0; i < times.size(); ++i) {
    force_at(system, times[i], q.row(i), v.row(i), a.row(i), w, f, wrench);
    for (const auto &[row, pull] : along) {
      evaluate(row, w.bodies, motion);
      motion.coefficient_a *= -pull, motion.coefficient_b *= -pull;
      jacobian(row, motion, system.bodies, w.bodies, system.first_coordinate, f);
    }
    result.row(i) = f;
  }
  return result;
}

// (T, 3 markers of all bodies) of drives, springs, rotors and of multipliers (T, constraints)
RowMajorMatrix marker_wrenches(const System &system, const VectorXd &times, const RowMajorMatrix &q,
                               const RowMajorMatrix &v, const RowMajorMatrix &a, const RowMajorMatrix &multipliers) {
  check_motions(system, times, q, v, a);
  const auto held = static_cast<Eigen::Index>(system.n_bilateral());
  check_size("multipliers rows", multipliers.rows(), times.size());
  check_size("multipliers columns", multipliers.cols(), held);
  Workspace w(system);
  Eigen::Index columns = 0;
  for (const auto &body : system.bodies)
    columns += 3 * body.markers();
  RowMajorMatrix result(times.size(), columns);
  VectorXd f(system.n_v());
  std::vector<Eigen::Matrix3Xd> wrench;
  MeasureMotion motion;
  for (Eigen::Index i = 0; i < times.size(); ++i) {
    force_at(system, times[i], q.row(i), v.row(i), a.row(i), w, f, wrench);
    for (Eigen::Index r = 0; r < held; ++r) {
      const Measure &row = system.rows[static_cast<std::size_t>(r)];
      evaluate(row, w.bodies, motion);
      add_wrench(row, motion, -multipliers(i, r), wrench);
    }
    Eigen::Index first = 0;
    for (const auto &of_body : wrench) {
      result.row(i).segment(first, of_body.size()) = of_body.reshaped().transpose();
      first += of_body.size();
    }
  }
  return result;
}

// (kinetic, strain, gravitational, dissipated power) of the system, one row per state
MatrixXd energies(const System &system, const MatrixXd &q, const MatrixXd &v) {
  check_size("q columns", q.cols(), system.n_q());
  check_size("v columns", v.cols(), system.n_v());
  check_size("v rows", v.rows(), q.rows());
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
  check_size("q columns", q.cols(), system.n_q());
  Workspace w(system);
  const auto T = static_cast<std::size_t>(q.rows()), m = system.n_bilateral();
  const auto n = static_cast<std::size_t>(system.n_v());
  auto *data = new double[T * m * n];
  nb::capsule owner(data, [](void *p) noexcept { delete[] static_cast<double *>(p); });
  const VectorXd rest = VectorXd::Zero(system.n_v());
  VectorXd value(static_cast<Eigen::Index>(system.rows.size())), rate(value);
  for (std::size_t i = 0; i < T; ++i) {
    const VectorXd q_i = q.row(static_cast<Eigen::Index>(i)).transpose();
    constraint_residuals(system, 0.0, q_i.data(), rest.data(), w, value.data(), rate.data());
    Eigen::Map<RowMajorMatrix>(data + i * m * n, static_cast<Eigen::Index>(m), system.n_v()) =
        constraint_jacobian(system, w);
  }
  return Samples(data, {T, m, n}, owner);
}

VectorXd integrate_coordinates(const System &system, const VectorXd &q, const VectorXd &dq) {
  check_size("q", q.size(), system.n_q());
  check_size("dq", dq.size(), system.n_v());
  VectorXd result(system.n_q());
  system.space.integrate(q.data(), 1, dq.data(), result.data());
  return result;
}

VectorXd difference_of_coordinates(const System &system, const VectorXd &q1, const VectorXd &q0) {
  check_size("q1", q1.size(), system.n_q());
  check_size("q0", q0.size(), system.n_q());
  VectorXd dq(system.n_v());
  system.space.difference(q1.data(), q0.data(), dq.data());
  return dq;
}

double time_evaluations(const System &system, double t, const VectorXd &q, const VectorXd &v, int repetitions) {
  check_size("q", q.size(), system.n_q());
  check_size("v", v.size(), system.n_v());
  Workspace w(system);
  VectorXd a(system.n_v());
  for (int i = 0; i < repetitions; ++i)
    accelerations(system, t, q.data(), v.data(), w, a.data());
  return a[0];
}

} // namespace

void bind_evaluations(nb::module_ &m, nb::class_<System> &system) {
  system.def("integrate", &integrate_coordinates, "q"_a, "dq"_a, "Coordinates (n_q,) moved from q by dq (n_v,).")
      .def("difference", &difference_of_coordinates, "q1"_a, "q0"_a, "dq (n_v,) with q1 = integrate(q0, dq).")
      .def("evaluate", &evaluate_state, "t"_a, "q"_a, "v"_a, "external_loads"_a = nb::none(),
           "Accelerations (n_v,) and multipliers (constraints,).")
      .def("constraints", &constraints, "t"_a, "q"_a, "v"_a, "C, C_dot (constraints,) and C_q (constraints, n_v).")
      .def("acceleration_violation", &acceleration_violation, "t"_a, "q"_a, "v"_a, "a"_a,
           "The largest |C_ddot| for accelerations a (n_v,), relative to 1 and the terms that cancel in it.")
      .def("constraint_jacobians", &constraint_jacobians, "q"_a, "C_q (T, constraints, n_v) at q (T, n_q).")
      .def("rotor_rows", &rotor_rows, "q"_a, "Gradients (rotors, n_v) of the rotors' angles and inertias (rotors,).")
      .def("force_at_rest", &force_at_rest, "t"_a, "q"_a, "Generalized forces (n_v,) of gravity, elasticity, drives.")
      .def(
          "required_forces", &required_forces, "times"_a, "q"_a, "v"_a, "a"_a, "pulls"_a = nb::none(),
          "f = M a - Q (T, n_v), with the inertia of rotors: what constraints and actuators supply in a motion, beside "
          "`pulls`: (measure, N or N m) that are held.")
      .def("marker_wrenches", &marker_wrenches, "times"_a, "q"_a, "v"_a, "a"_a, "multipliers"_a,
           "Force and moment (T, 3 markers of all bodies), global axes, of drives, springs, rotors and multipliers.")
      .def("energies", &energies, "q"_a, "v"_a, "Kinetic, strain, gravitational energy and dissipated power (T, 4).");
  m.def("time_evaluations", &time_evaluations, "system"_a, "t"_a, "q"_a, "v"_a, "repetitions"_a,
        "Evaluates the accelerations many times, for benchmarks.");
}
