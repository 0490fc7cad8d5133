#include "core/analysis/run.h"

#include <nanobind/eigen/dense.h>
#include <nanobind/nanobind.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include "bindings/analysis/analysis.h"
#include "bindings/changes.h"

namespace nb = nanobind;
using namespace ffrobot;

void bind_run(nb::module_ &m) {
  nb::class_<Run>(m, "Run", "Outputs of an analysis, one row per output time reached, and how it went.")
      .def_prop_ro("status", [](const Run &r) { return r.report.status; })
      .def_prop_ro("time_reached", [](const Run &r) { return r.report.time; })
      .def_prop_ro("last", [](const Run &r) -> const Eigen::VectorXd & { return r.last; })
      .def_prop_ro("steps", [](const Run &r) { return r.report.steps; })
      .def_prop_ro("rejected", [](const Run &r) { return r.report.rejected; })
      .def_prop_ro("evaluations", [](const Run &r) { return r.report.evaluations; })
      .def_prop_ro("last_step", [](const Run &r) { return r.report.last_step; })
      .def_prop_ro("last_error", [](const Run &r) { return r.report.last_error; })
      .def_prop_ro(
          "changes", [](const Run &r) { return changes_of(r.report); },
          "Of integrators: (time, from, to, mean step before) of each.")
      .def_prop_ro(
          "step_ends", [](const Run &r) { return r.report.step_ends; },
          "Times (s) where steps ended, as controls ask for them; none where they cannot be repeated.")
      // references: the arrays are views that keep their Run alive
      .def_prop_ro("q", [](const Run &r) -> const RowMajorMatrix & { return r.outputs.q; })
      .def_prop_ro("v", [](const Run &r) -> const RowMajorMatrix & { return r.outputs.v; })
      .def_prop_ro("a", [](const Run &r) -> const RowMajorMatrix & { return r.outputs.a; })
      .def_prop_ro("multipliers", [](const Run &r) -> const RowMajorMatrix & { return r.outputs.lambda; })
      .def_prop_ro("tau", [](const Run &r) -> const RowMajorMatrix & { return r.outputs.tau; })
      .def_prop_ro("F_p", [](const Run &r) -> const RowMajorMatrix & { return r.outputs.F_p; })
      .def_prop_ro("shape_force", [](const Run &r) -> const RowMajorMatrix & { return r.outputs.shape_force; })
      .def_prop_ro("residual", [](const Run &r) -> const RowMajorMatrix & { return r.outputs.residual; });
}
