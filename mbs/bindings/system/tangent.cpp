#include "core/system/tangent.h"
#include "core/system/reduction.h"

#include <nanobind/eigen/dense.h>
#include <nanobind/nanobind.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include "bindings/bindings.h"
#include "bindings/system/system.h"

namespace nb = nanobind;
using namespace nb::literals;
using namespace ffrobot;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

void check_motion(const System &system, const VectorXd &q, const VectorXd &v, const VectorXd &a) {
  check_size("q", q.size(), system.n_q());
  check_size("v", v.size(), system.n_v());
  check_size("a", a.size(), system.n_v());
}

// (M, D, K, C_q) at one state
std::tuple<MatrixXd, MatrixXd, MatrixXd, MatrixXd> system_tangent(const System &system, double t, const VectorXd &q,
                                                                  const VectorXd &v, const VectorXd &a,
                                                                  const VectorXd &multipliers,
                                                                  const std::vector<double> &external_drive) {
  check_motion(system, q, v, a);
  check_size("multipliers", multipliers.size(), static_cast<Index>(system.n_bilateral()));
  Workspace w(system);
  if (!external_drive.empty()) {
    check_size("external_drive", static_cast<Index>(external_drive.size()), static_cast<Index>(system.drives.size()));
    w.external_drive = external_drive;
  }
  Tangent result(system.n_v());
  tangent(system, t, q.data(), v.data(), a.data(), w, result);
  for (std::size_t r = 0; r < system.n_bilateral(); ++r)
    add_row_curvature(system, system.rows[r], multipliers[static_cast<Index>(r)], w, result.K);
  return {result.M, result.D, result.K, constraint_jacobian(system, w)};
}

// (by_acceleration, by_velocity, by_position) of rows
std::tuple<MatrixXd, MatrixXd, MatrixXd> row_tangents(const System &system, const std::vector<Measure> &rows,
                                                      const VectorXd &q, const VectorXd &v, const VectorXd &a) {
  check_motion(system, q, v, a);
  Workspace w(system);
  VectorXd ignored(system.n_v());
  required_force(system, 0.0, q.data(), v.data(), a.data(), w, ignored.data());
  RowTangents result(static_cast<Index>(rows.size()), system.n_v());
  for (std::size_t i = 0; i < rows.size(); ++i)
    row_tangent(system, rows[i], q.data(), v.data(), a.data(), w, static_cast<Index>(i), result);
  return {result.by_acceleration, result.by_velocity, result.by_position};
}

Reduction reduce(const System &system, const std::vector<Measure> &independent, double t, const VectorXd &q,
                 const VectorXd &v, const VectorXd &a) {
  check_motion(system, q, v, a);
  Workspace w(system);
  Reduction reduction(system, independent);
  reduction.reduce(t, q.data(), v.data(), a.data(), w);
  return reduction;
}

} // namespace

void bind_tangent(nb::module_ &m) {
  m.def("tangent", &system_tangent, "system"_a, "t"_a, "q"_a, "v"_a, "a"_a, "multipliers"_a, "external_drive"_a,
        "M, D = -dQ/dv, K = d(M a + C_q^T lambda - Q)/dq and C_q; external_drive empty, or one force for each drive.");
  m.def("row_tangents", &row_tangents, "system"_a, "rows"_a, "q"_a, "v"_a, "a"_a,
        "Derivatives (rows, coordinates) of the rows' accelerations with respect to a, v and q.");
  nb::class_<Reduction>(m, "Reduction", "The linear equations of a motion in independent coordinates.")
      .def_ro("M", &Reduction::M)
      .def_ro("D", &Reduction::D)
      .def_ro("K", &Reduction::K)
      .def_ro("H", &Reduction::H)
      .def_ro("H_dot", &Reduction::H_dot)
      .def_ro("multipliers", &Reduction::lambda)
      .def_ro("force", &Reduction::force)
      .def_ro("reciprocal_condition", &Reduction::reciprocal_condition);
  m.def("reduce", &reduce, "system"_a, "independent"_a, "t"_a, "q"_a, "v"_a, "a"_a, nb::keep_alive<0, 1>(),
        "Linear equations in s = (values of the independent rows, p).");
}
