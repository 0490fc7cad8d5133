#include "core/integrate/integrate.h"

#include <nanobind/eigen/dense.h>
#include <nanobind/nanobind.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <stdexcept>

#include "bindings/bindings.h"

namespace nb = nanobind;
using namespace nb::literals;
using namespace ffrobot;
using Eigen::VectorXd;

namespace {

VectorXd as_vector(const std::vector<double> &values) {
  return Eigen::Map<const VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
}

using Kinds = std::vector<std::pair<std::size_t, MethodKind>>; // of a recording's steps, from the first of each on

void make_recording(Recording *r, const VectorXd &times, const VectorXd &states, const Kinds &kinds,
                    double spectral_radius, double tolerance) {
  if (kinds.empty() || kinds.front().first != 0)
    throw std::invalid_argument("methods: expected one from the first step on, found none");
  new (r) Recording{{times.begin(), times.end()}, {states.begin(), states.end()}, tolerance, {}};
  for (const auto &[first, kind] : kinds)
    r->methods.emplace_back(first, MethodChoice{kind, spectral_radius});
}

Kinds kinds_of(const Recording &r) {
  Kinds kinds;
  for (const auto &[first, method] : r.methods)
    kinds.emplace_back(first, method.kind);
  return kinds;
}

void make_controls(IntegrationControls *c, double tolerance, unsigned long max_steps,
                   const std::vector<std::tuple<MethodKind, double, double>> &methods, double spectral_radius) {
  if (methods.empty() || methods.size() > 2)
    throw std::invalid_argument("methods: expected one or two, found " + std::to_string(methods.size()));
  new (c) IntegrationControls{.tolerance = tolerance, .max_steps = max_steps, .methods = {}};
  for (const auto &[kind, cost, pace] : methods)
    c->methods.push_back({{kind, spectral_radius}, cost, pace});
}

void bind_kinds(nb::module_ &m) {
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
}

void bind_histories(nb::module_ &m) {
  nb::class_<StepHistory>(m, "StepHistory", "What the size of the next step follows from.")
      .def(
          "__init__",
          [](StepHistory *s, double next_step, double usual_step, double reserve, double previous_step,
             double previous_error, bool in_transient, int without_look) {
            new (s)
                StepHistory{next_step, usual_step, reserve, previous_step, previous_error, in_transient, without_look};
          },
          nb::kw_only(), "next_step"_a, "usual_step"_a, "reserve"_a, "previous_step"_a, "previous_error"_a,
          "in_transient"_a, "without_look"_a = 0)
      .def_ro("next_step", &StepHistory::next_step)
      .def_ro("usual_step", &StepHistory::usual_step)
      .def_ro("reserve", &StepHistory::reserve)
      .def_ro("previous_step", &StepHistory::previous_step)
      .def_ro("previous_error", &StepHistory::previous_error)
      .def_ro("in_transient", &StepHistory::in_transient)
      .def_ro("without_look", &StepHistory::without_look);
  nb::class_<MethodHistory>(m, "MethodHistory", "What the choice between two integrators follows from during a run.")
      .def(
          "__init__",
          [](MethodHistory *h, bool second, double pace_of_other, double since, double measured, unsigned long tries,
             unsigned long window, unsigned long trial) {
            new (h) MethodHistory{second, pace_of_other, since, measured, tries, window, trial};
          },
          nb::kw_only(), "second"_a, "pace_of_other"_a, "since"_a, "measured"_a, "tries"_a, "window"_a, "trial"_a)
      .def_ro("second", &MethodHistory::second)
      .def_ro("pace_of_other", &MethodHistory::pace_of_other)
      .def_ro("since", &MethodHistory::since)
      .def_ro("measured", &MethodHistory::measured)
      .def_ro("tries", &MethodHistory::tries)
      .def_ro("window", &MethodHistory::window)
      .def_ro("trial", &MethodHistory::trial);
}

} // namespace

void bind_integrate(nb::module_ &m) {
  bind_kinds(m);
  bind_histories(m);
  nb::class_<IntegrationControls>(m, "IntegrationControls", "What an integration is made with; max_steps 0: no limit.")
      .def("__init__", &make_controls, nb::kw_only(), "tolerance"_a, "max_steps"_a, "methods"_a, "spectral_radius"_a,
           "methods: one, or two of which the faster is found out, each with the cost of a step and the pace that is\n"
           "expected of it, in s of the run per cost.")
      .def_rw("keep_steps", &IntegrationControls::keep_steps,
              "Whether ends of steps are reported, if they can be repeated.")
      .def_rw("stops", &IntegrationControls::stops, "Times (s), ascending, at which steps end, too.")
      .def_rw("repeated_steps", &IntegrationControls::repeated_steps,
              "Ends (s) of the steps to take, with the first method and whatever their error; none: as the tolerance\n"
              "wants them.");
  nb::class_<Samples>(m, "Samples", "States within a run, closer than its outputs: mbs/core/integrate/integrate.h.")
      .def(
          "__init__",
          [](Samples *s, double longest, std::size_t most, std::vector<double> times, std::vector<double> states,
             unsigned long steps, unsigned long every) {
            if (!(longest > 0) || most < 2 || every < 1)
              throw std::invalid_argument("samples: expected a positive time between them, and at least two");
            new (s) Samples{longest, most, std::move(times), std::move(states), steps, every};
          },
          "longest"_a, "most"_a, "times"_a = std::vector<double>{}, "states"_a = std::vector<double>{}, "steps"_a = 0,
          "every"_a = 1,
          "longest: s between two of them, where steps are longer; most: of them. The others are those of an earlier "
          "run that goes on.")
      .def_ro("longest", &Samples::longest)
      .def_ro("most", &Samples::most)
      .def_ro("steps", &Samples::steps)
      .def_ro("every", &Samples::every)
      .def_prop_ro("times", [](const Samples &s) { return as_vector(s.times); })
      .def_prop_ro(
          "states", [](const Samples &s) { return as_vector(s.states); }, "(q, v) of each, one after the other.");
  nb::class_<Recording>(m, "Recording", "The accepted steps of a run, from which its dense output can be made again.")
      .def(nb::init<>())
      .def("__init__", &make_recording, "times"_a, "states"_a, "methods"_a, "spectral_radius"_a, "tolerance"_a,
           "That of an earlier run: times (N,), states (N (n_q + n_v),) one after the other; methods: the first step\n"
           "of each and its kind.")
      .def_prop_ro("steps", [](const Recording &r) { return r.times.size(); })
      .def_prop_ro("methods", &kinds_of)
      .def_prop_ro("times", [](const Recording &r) { return as_vector(r.times); })
      .def_prop_ro("states", [](const Recording &r) { return as_vector(r.states); });
}
