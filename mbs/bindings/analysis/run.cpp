#include "core/analysis/run.h"

#include <nanobind/eigen/dense.h>
#include <nanobind/nanobind.h>
#include <nanobind/stl/function.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include "bindings/analysis/analysis.h"
#include "bindings/bindings.h"
#include "bindings/changes.h"

namespace nb = nanobind;
using namespace nb::literals;
using namespace ffrobot;
using Eigen::Index;
using Eigen::VectorXd;

namespace {

// One kind of peak of all bodies
template <double BodyPeaks::*peak> VectorXd of_bodies(const Peaks &peaks) {
  VectorXd values(static_cast<Index>(peaks.bodies.size()));
  for (std::size_t b = 0; b < peaks.bodies.size(); ++b)
    values[static_cast<Index>(b)] = peaks.bodies[b].*peak;
  return values;
}

void make_peaks(Peaks *peaks, const VectorXd &velocity, const VectorXd &angular_velocity,
                const VectorXd &modal_velocity, const VectorXd &modal, const VectorXd &acceleration,
                const VectorXd &angular_acceleration, const VectorXd &modal_acceleration, VectorXd groups) {
  new (peaks) Peaks{{}, std::move(groups)};
  for (const VectorXd *of :
       {&angular_velocity, &modal_velocity, &modal, &acceleration, &angular_acceleration, &modal_acceleration})
    check_size("peaks of bodies", of->size(), velocity.size());
  for (Index b = 0; b < velocity.size(); ++b)
    peaks->bodies.push_back({velocity[b], angular_velocity[b], modal_velocity[b], modal[b], acceleration[b],
                             angular_acceleration[b], modal_acceleration[b]});
}

void bind_checkpoint(nb::module_ &m) {
  nb::class_<Peaks>(m, "Peaks", "Largest sizes so far, of each body's motion (bodies,) and of multipliers (groups,).")
      .def("__init__", &make_peaks, nb::kw_only(), "velocity"_a, "angular_velocity"_a, "modal_velocity"_a, "modal"_a,
           "acceleration"_a, "angular_acceleration"_a, "modal_acceleration"_a, "groups"_a)
      .def_prop_ro("velocity", &of_bodies<&BodyPeaks::velocity>)
      .def_prop_ro("angular_velocity", &of_bodies<&BodyPeaks::angular_velocity>)
      .def_prop_ro("modal_velocity", &of_bodies<&BodyPeaks::modal_velocity>)
      .def_prop_ro("modal", &of_bodies<&BodyPeaks::modal>)
      .def_prop_ro("acceleration", &of_bodies<&BodyPeaks::acceleration>)
      .def_prop_ro("angular_acceleration", &of_bodies<&BodyPeaks::angular_acceleration>)
      .def_prop_ro("modal_acceleration", &of_bodies<&BodyPeaks::modal_acceleration>)
      .def_ro("groups", &Peaks::groups);
  nb::class_<Checkpoint>(m, "Checkpoint", "Where a run has stopped, and all that its next step depends on.")
      .def(nb::init<>())
      .def(
          "__init__",
          [](Checkpoint *c, double time, VectorXd state, const StepHistory &steps, Peaks peaks, std::size_t outputs,
             const MethodHistory &methods) {
            new (c) Checkpoint{{time, std::move(state), steps, outputs, methods}, std::move(peaks)};
          },
          nb::kw_only(), "time"_a, "state"_a, "steps"_a, "peaks"_a, "outputs"_a, "methods"_a, "state (n_q + n_v,).")
      .def_prop_ro("time", [](const Checkpoint &c) { return c.integration.time; })
      .def_prop_ro("state", [](const Checkpoint &c) { return c.integration.state; })
      .def_prop_ro("steps", [](const Checkpoint &c) { return c.integration.steps; })
      .def_prop_ro("outputs", [](const Checkpoint &c) { return c.integration.outputs; })
      .def_prop_ro("methods", [](const Checkpoint &c) { return c.integration.methods; })
      .def_ro("peaks", &Checkpoint::peaks);
}

void bind_outputs(nb::module_ &m) {
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

Run run_system(const System &system, std::vector<int> groups, std::vector<bool> moments, std::vector<Measure> joints,
               const std::vector<double> &times, const VectorXd &q, const VectorXd &v,
               const IntegrationControls &controls, const std::function<bool(double)> &carry_on,
               ExternalLoads *external_loads, ActuatorForces *actuator_forces, Recording *recording,
               Checkpoint *checkpoint) {
  check_size("q", q.size(), system.n_q());
  check_size("v", v.size(), system.n_v());
  check_size("moments", static_cast<Index>(moments.size()), static_cast<Index>(groups.size()));
  const nb::gil_scoped_release unlocked;
  ConstrainedMotion motion(
      system, {system, {std::move(groups), std::move(moments), std::move(joints), actuator_forces}}, external_loads);
  return run(motion, times, q, v, controls, {system, times.size(), external_loads, actuator_forces}, locked(carry_on),
             recording, checkpoint);
}

} // namespace

void bind_run(nb::module_ &m) {
  bind_checkpoint(m);
  bind_outputs(m);
  m.def("run", &run_system, nb::kw_only(), "system"_a, "groups"_a, "moments"_a, "joints"_a, "times"_a, "q"_a, "v"_a,
        "controls"_a, "carry_on"_a, "external_loads"_a = nb::none(), "actuator_forces"_a = nb::none(),
        "recording"_a = nb::none(), "checkpoint"_a = nb::none(),
        "Integrates the motion from (q, v), or on from a checkpoint, which it moves, and reports it at `times`.");
}
