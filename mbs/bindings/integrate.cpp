#include "core/integrate/integrate.h"

#include "bindings/bindings.h"

#include <nanobind/eigen/dense.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

namespace {

VectorXd as_vector(const std::vector<double> &values) { return Map<const VectorXd>(values.data(), values.size()); }

void make_controls(IntegrationControls *c, double tolerance, unsigned long max_steps,
                   const std::vector<std::tuple<MethodKind, double, double>> &methods, double spectral_radius) {
  if (methods.empty() || methods.size() > 2)
    throw std::invalid_argument("methods: expected one or two, found " + std::to_string(methods.size()));
  new (c) IntegrationControls;
  c->tolerance = tolerance;
  c->max_steps = max_steps;
  c->methods.clear();
  for (const auto &[kind, cost, pace] : methods)
    c->methods.push_back({{kind, spectral_radius}, cost, pace});
}

void bind_kinds(nb::module_ &m) {
  bind_values(nb::enum_<IntegrationStatus>(m, "IntegrationStatus", "How an integration ended."),
              FFROBOT_VALUES(IntegrationStatus, completed, step_underflow, too_many_steps, interrupted, diverged));
  bind_values(nb::enum_<MethodKind>(m, "MethodKind", "The integrators."),
              FFROBOT_VALUES(MethodKind, dopri5, dop853, radau, generalized_alpha));
}

} // namespace

void bind_integrate(nb::module_ &m) {
  bind_kinds(m);
  nb::class_<IntegrationControls>(m, "IntegrationControls", "Settings of an integration; max_steps 0: no limit.")
      .def(
          "__init__", &make_controls, nb::kw_only(), "tolerance"_a, "max_steps"_a, "methods"_a, "spectral_radius"_a,
          "methods: (kind, cost of a step, expected pace in s of the run per cost) of one, or of two of which the run\n"
          "takes the faster.")
      .def_rw("keep_steps", &IntegrationControls::keep_steps,
              "Whether ends of steps are kept, if they can be repeated.")
      .def_rw("stops", &IntegrationControls::stops, "Times (s), ascending, at which steps end, too.")
      .def_rw("repeated_steps", &IntegrationControls::repeated_steps,
              "Ends (s) of the steps to take, with the first method and any error; empty: by the tolerance.");
  auto samples = nb::class_<Samples>(m, "Samples",
                                     "States within a run, closer than its outputs: mbs/core/integrate/integrate.h.");
  samples
      .def(nb::init<double, std::size_t, int>(), "longest"_a, "most"_a, "parts"_a = 1,
           "longest: s between two samples; most: samples in all; parts: of each step, at least.")
      .def_ro("every", &Samples::every, "Ends of every so many steps are samples.")
      .def_prop_ro("times", [](const Samples &s) { return as_vector(s.times); })
      .def_prop_ro(
          "states", [](const Samples &s) { return as_vector(s.states); }, "(q, v) of each, one after the other.");
  bind_bytes(samples);
  auto recording = nb::class_<Recording>(m, "Recording",
                                         "The accepted steps of a run, from which its dense output can be made again.");
  recording.def(nb::init<>());
  bind_bytes(recording);
}
