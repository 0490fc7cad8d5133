#include "core/analysis/run.h"
#include "core/analysis/sampled.h"

#include <nanobind/eigen/dense.h>
#include <nanobind/nanobind.h>
#include <nanobind/stl/function.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <algorithm>

#include "bindings/bindings.h"

namespace nb = nanobind;
using namespace nb::literals;
using namespace ffrobot;

namespace {

Eigen::Map<const Eigen::VectorXd> as_vector(const std::vector<double> &values) {
  return {values.data(), static_cast<Eigen::Index>(values.size())};
}

// States (2 steps + 1, 2 coordinates) of equal steps: where they end and, by dense output, in their middle.
RowMajorMatrix fixed_steps(const System &system, double end, int steps, const Eigen::VectorXd &q,
                           const Eigen::VectorXd &v, MethodKind kind, double spectral_radius) {
  constexpr double newton_tolerance = 1e-8;
  ConstrainedMotion motion(system, {}, {}, nullptr);
  const auto made = make_method({kind, spectral_radius}, motion);
  Method &method = *made;
  Eigen::VectorXd y(motion.size()), middle(motion.size());
  y << q, v;
  RowMajorMatrix states(2 * steps + 1, y.size());
  states.row(0) = y;
  const double h = end / steps;
  motion.plan(end);
  motion.slope(0, y.data(), method.first_slope());
  motion.accepted(0, y.data(), method.first_slope());
  for (int i = 0; i < steps; ++i) {
    if (!method.step(i * h, y.data(), h, newton_tolerance) || !method.correct((i + 1) * h))
      throw std::runtime_error("the equations of step " + std::to_string(i) + " could not be solved");
    motion.slope((i + 1) * h, method.end(), method.last_slope());
    method.prepare_dense(i * h, y.data(), h);
    method.interpolate((i + 0.5) * h, middle.data());
    method.accept(h);
    y = Eigen::Map<const Eigen::VectorXd>(method.end(), y.size());
    std::copy_n(method.last_slope(), y.size(), method.first_slope());
    states.row(2 * i + 1) = middle;
    states.row(2 * i + 2) = y;
  }
  return states;
}

} // namespace

void bind_run(nb::module_ &m) {
  nb::enum_<IntegrationStatus>(m, "IntegrationStatus", "How an integration ended.")
      .value("completed", IntegrationStatus::completed)
      .value("step_underflow", IntegrationStatus::step_underflow)
      .value("too_many_steps", IntegrationStatus::too_many_steps)
      .value("interrupted", IntegrationStatus::interrupted)
      .value("diverged", IntegrationStatus::diverged);

  nb::enum_<MethodKind>(m, "MethodKind", "The integrators.")
      .value("dopri5", MethodKind::dopri5)
      .value("dop853", MethodKind::dop853)
      .value("radau", MethodKind::radau)
      .value("generalized_alpha", MethodKind::generalized_alpha);

  nb::class_<Recording>(m, "Recording", "The accepted steps of a run, from which its dense output can be made again.")
      .def(nb::init<>())
      .def(
          "__init__",
          [](Recording *r, const Eigen::VectorXd &times, const Eigen::VectorXd &states, MethodKind method,
             double spectral_radius, double tolerance) {
            new (r) Recording{
                {times.begin(), times.end()}, {states.begin(), states.end()}, {method, spectral_radius}, tolerance};
          },
          "times"_a, "states"_a, "method"_a, "spectral_radius"_a, "tolerance"_a,
          "That of an earlier run: times (N,), states (N x 2 coordinates) one after the other.")
      .def_prop_ro("steps", [](const Recording &r) { return r.times.size(); })
      // moved: a property's value is else taken for a part of its object, as which nanobind 2.5 keeps a dead address
      .def_prop_ro(
          "times", [](const Recording &r) { return Eigen::VectorXd(as_vector(r.times)); }, nb::rv_policy::move)
      .def_prop_ro(
          "states", [](const Recording &r) { return Eigen::VectorXd(as_vector(r.states)); }, nb::rv_policy::move);

  nb::class_<Checkpoint>(m, "Checkpoint", "Where a run has stopped, and all that its next step depends on.")
      .def(nb::init<>())
      .def(
          "__init__",
          [](Checkpoint *c, double time, Eigen::VectorXd state, Eigen::VectorXd stepping, Eigen::VectorXd gathered,
             std::size_t outputs) {
            new (c) Checkpoint{time, std::move(state), std::move(stepping), std::move(gathered), outputs};
          },
          "time"_a, "state"_a, "stepping"_a, "gathered"_a, "outputs"_a)
      .def_ro("time", &Checkpoint::time)
      .def_ro("state", &Checkpoint::state)
      .def_ro("stepping", &Checkpoint::stepping)
      .def_ro("gathered", &Checkpoint::gathered)
      .def_ro("outputs", &Checkpoint::outputs);

  nb::class_<ExternalLoads>(m, "ExternalLoads", "Steers a system from outside.");

  nb::class_<Run>(m, "Run", "Outputs of an analysis, one row per output time reached, and how it went.")
      .def_prop_ro("status", [](const Run &r) { return r.report.status; })
      .def_prop_ro("time_reached", [](const Run &r) { return r.report.time; })
      .def_prop_ro("last", [](const Run &r) -> const Eigen::VectorXd & { return r.last; })
      .def_prop_ro("steps", [](const Run &r) { return r.report.steps; })
      .def_prop_ro("rejected", [](const Run &r) { return r.report.rejected; })
      .def_prop_ro("evaluations", [](const Run &r) { return r.report.evaluations; })
      // references: the arrays are views that keep their Run alive
      .def_prop_ro("q", [](const Run &r) -> const RowMajorMatrix & { return r.outputs.q; })
      .def_prop_ro("v", [](const Run &r) -> const RowMajorMatrix & { return r.outputs.v; })
      .def_prop_ro("a", [](const Run &r) -> const RowMajorMatrix & { return r.outputs.a; })
      .def_prop_ro("multipliers", [](const Run &r) -> const RowMajorMatrix & { return r.outputs.lambda; })
      .def_prop_ro("tau", [](const Run &r) -> const RowMajorMatrix & { return r.outputs.tau; })
      .def_prop_ro("F_p", [](const Run &r) -> const RowMajorMatrix & { return r.outputs.F_p; })
      .def_prop_ro("residual", [](const Run &r) -> const RowMajorMatrix & { return r.outputs.residual; });

  m.def(
      "run",
      [](const System &system, std::vector<int> group, std::vector<bool> moment, ExternalLoads *steering,
         const std::vector<double> &times, const Eigen::VectorXd &q, const Eigen::VectorXd &v, double tolerance,
         unsigned long max_steps, MethodKind method, double spectral_radius, ActuatorForces *resolver,
         const std::function<bool(double)> &carry_on, Recording *recording, Checkpoint *checkpoint) {
        const nb::gil_scoped_release unlocked;
        ConstrainedMotion motion(system, std::move(group), std::move(moment), steering);
        const auto ask = [&](double t) {
          const nb::gil_scoped_acquire locked;
          return carry_on(t);
        };
        return run(motion, times, q, v, {tolerance, max_steps, {method, spectral_radius}}, steering, resolver, ask,
                   recording, checkpoint);
      },
      "system"_a, "group"_a, "moment"_a, "steering"_a.none(), "times"_a, "q"_a, "v"_a, "tolerance"_a, "max_steps"_a,
      "method"_a, "spectral_radius"_a, "resolver"_a.none(), "carry_on"_a, "recording"_a.none(), "checkpoint"_a.none(),
      "Integrates the motion from (q, v), or on from a checkpoint, which it moves, and reports it at `times`.");

  nb::class_<Sensing>(m, "Sensing", "What sensors read of a state: rows, then modal coordinates, or their rates.")
      .def(
          "__init__",
          [](Sensing *s, const System &system, const std::vector<std::pair<Measure, int>> &rows,
             const std::vector<std::tuple<std::size_t, Eigen::VectorXd, int>> &modes) {
            std::vector<Sensing::AlongRow> along;
            std::vector<Sensing::OfModes> of;
            for (const auto &[row, order] : rows)
              along.push_back({row, order});
            for (const auto &[body, vector, order] : modes)
              of.push_back({body, vector, order});
            new (s) Sensing(system, std::move(along), std::move(of));
          },
          "system"_a, "rows"_a, "modes"_a, nb::keep_alive<1, 2>())
      .def(
          "read",
          [](Sensing &s, const RowMajorMatrix &q, const RowMajorMatrix &v, const RowMajorMatrix &a) {
            RowMajorMatrix readings(q.rows(), s.count());
            for (Eigen::Index i = 0; i < q.rows(); ++i)
              readings.row(i) = s.read(q.row(i).data(), v.row(i).data(), a.row(i).data()).transpose();
            return readings;
          },
          "q"_a, "v"_a, "a"_a, "Readings (T, sensors) of states (T, coordinates).");

  m.def(
      "run_sampled",
      [](const System &system, std::vector<int> group, std::vector<bool> moment, const std::vector<double> &times,
         const Eigen::VectorXd &q, const Eigen::VectorXd &v, double tolerance, unsigned long max_steps,
         MethodKind method, double spectral_radius, std::size_t motors, std::vector<HeldCommands::Patches> patches,
         const Eigen::VectorXd &first_command, Sensing &sensing, const std::vector<double> &samples, double delay,
         const std::function<Eigen::VectorXd(std::size_t, double, const Eigen::VectorXd &)> &controller,
         const std::function<bool(double)> &carry_on) {
        const nb::gil_scoped_release unlocked;
        HeldCommands commands(motors, std::move(patches));
        commands.set(first_command);
        ConstrainedMotion motion(system, std::move(group), std::move(moment), &commands);
        const auto ask = [&](double t) {
          const nb::gil_scoped_acquire locked;
          return carry_on(t);
        };
        const auto command = [&](std::size_t k, double t, const Eigen::VectorXd &y) {
          const nb::gil_scoped_acquire locked;
          return controller(k, t, y);
        };
        return run_sampled(motion, times, q, v, {tolerance, max_steps, {method, spectral_radius}}, commands, sensing,
                           {samples, delay, command}, ask);
      },
      "system"_a, "group"_a, "moment"_a, "times"_a, "q"_a, "v"_a, "tolerance"_a, "max_steps"_a, "method"_a,
      "spectral_radius"_a, "motors"_a, "patches"_a, "first_command"_a, "sensing"_a, "samples"_a, "delay"_a,
      "controller"_a, "carry_on"_a, "As run, under commands that `controller`(k, t, readings) gives at samples.");

  m.def("fixed_steps", &fixed_steps, "system"_a, "end"_a, "steps"_a, "q"_a, "v"_a, "method"_a, "spectral_radius"_a,
        "States after equal steps and in their middle (2 steps + 1, 2 coordinates), for convergence studies.");
}
