#include "core/system/system.h"

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

// (C, C_dot, C_q) at one state
std::tuple<VectorXd, VectorXd, MatrixXd> constraints(const System &system, double t, const VectorXd &q,
                                                     const VectorXd &v) {
  check_size("q", q.size(), system.coordinates);
  check_size("v", v.size(), system.coordinates);
  Workspace w(system);
  VectorXd value(static_cast<Eigen::Index>(system.constraints.size())), rate(value);
  constraint_residuals(system, t, q.data(), v.data(), w, value.data(), rate.data());
  return {value, rate, constraint_jacobian(system, w)};
}

VectorXd force_at_rest(const System &system, double t, const VectorXd &q) {
  check_size("q", q.size(), system.coordinates);
  Workspace w(system);
  VectorXd Q(system.coordinates);
  static_force(system, t, q.data(), w, Q.data());
  return Q;
}

void check_motions(const System &system, const VectorXd &times, const RowMajorMatrix &q, const RowMajorMatrix &v,
                   const RowMajorMatrix &a) {
  check_size("q columns", q.cols(), system.coordinates);
  check_size("v columns", v.cols(), system.coordinates);
  check_size("a columns", a.cols(), system.coordinates);
  for (const RowMajorMatrix *values : {&q, &v, &a})
    check_size("rows of q, v and a", values->rows(), times.size());
}

// f = M a - Q of state i, with the inertia of rotors; leaves kinematics and the wrenches of drives in w.
void force_at(const System &system, double t, const VectorXd &q, const VectorXd &v, const VectorXd &a, Workspace &w,
              VectorXd &f, std::vector<Eigen::Matrix3Xd> &wrench) {
  required_force(system, t, q.data(), v.data(), a.data(), w, f.data());
  wrench = w.wrench;
  MeasureMotion motion;
  VectorXd gradient(system.coordinates);
  for (const Rotor &rotor : system.rotors) {
    evaluate(rotor.row, w.bodies, motion);
    const double force = rotor.inertia * row_acceleration(system, rotor.row, motion, a.data(), w);
    gradient.setZero();
    jacobian(rotor.row, motion, system.bodies, w.bodies, system.first_coordinate, gradient);
    f += force * gradient;
    add_wrench(rotor.row, motion, -force, wrench);
  }
}

// f (T, coordinates) of motions, beside forces `pulls` along measures
RowMajorMatrix required_forces(const System &system, const VectorXd &times, const RowMajorMatrix &q,
                               const RowMajorMatrix &v, const RowMajorMatrix &a,
                               const std::optional<std::vector<std::pair<Measure, double>>> &pulls) {
  check_motions(system, times, q, v, a);
  Workspace w(system);
  RowMajorMatrix result(times.size(), system.coordinates);
  VectorXd f(system.coordinates);
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
  const auto held = static_cast<Eigen::Index>(system.constraints.size());
  check_size("multipliers rows", multipliers.rows(), times.size());
  check_size("multipliers columns", multipliers.cols(), held);
  Workspace w(system);
  Eigen::Index columns = 0;
  for (const auto &body : system.bodies)
    columns += 3 * body.markers();
  RowMajorMatrix result(times.size(), columns);
  VectorXd f(system.coordinates);
  std::vector<Eigen::Matrix3Xd> wrench;
  MeasureMotion motion;
  for (Eigen::Index i = 0; i < times.size(); ++i) {
    force_at(system, times[i], q.row(i), v.row(i), a.row(i), w, f, wrench);
    for (Eigen::Index r = 0; r < held; ++r) {
      const Measure &row = system.constraints[static_cast<std::size_t>(r)].row;
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

using Samples = nb::ndarray<nb::numpy, double, nb::ndim<3>>;

// C_q (T, constraints, coordinates) at the coordinates q (T, coordinates)
Samples constraint_jacobians(const System &system, const RowMajorMatrix &q) {
  check_size("q columns", q.cols(), system.coordinates);
  Workspace w(system);
  const auto T = static_cast<std::size_t>(q.rows()), m = system.constraints.size();
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

} // namespace

void bind_evaluations(nb::class_<System> &system) {
  system
      .def("constraints", &constraints, "t"_a, "q"_a, "v"_a,
           "C, C_dot (constraints,) and C_q (constraints, coordinates).")
      .def("constraint_jacobians", &constraint_jacobians, "q"_a,
           "C_q (T, constraints, coordinates) at q (T, coordinates).")
      .def("force_at_rest", &force_at_rest, "t"_a, "q"_a,
           "Generalized forces (coordinates,) of gravity, elasticity, drives.")
      .def("required_forces", &required_forces, "times"_a, "q"_a, "v"_a, "a"_a, "pulls"_a = nb::none(),
           "f = M a - Q (T, coordinates), with the inertia of rotors: what constraints and actuators supply in a "
           "motion, beside "
           "`pulls`: (measure, N or N m) that are held.")
      .def("marker_wrenches", &marker_wrenches, "times"_a, "q"_a, "v"_a, "a"_a, "multipliers"_a,
           "Force and moment (T, 3 markers of all bodies), global axes, of drives, springs, rotors and multipliers.");
}
