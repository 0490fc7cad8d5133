#include "core/integrate/integrate.h"

#include <nanobind/eigen/dense.h>
#include <nanobind/nanobind.h>

#include "bindings/bindings.h"

namespace nb = nanobind;
using namespace nb::literals;
using namespace ffrobot;
using Eigen::VectorXd;

namespace {

VectorXd as_vector(const std::vector<double> &values) {
  return Eigen::Map<const VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
}

void make_recording(Recording *r, const VectorXd &times, const VectorXd &states, MethodKind method,
                    double spectral_radius, double tolerance) {
  new (r) Recording{{times.begin(), times.end()}, {states.begin(), states.end()}, {method, spectral_radius}, tolerance};
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

} // namespace

void bind_integrate(nb::module_ &m) {
  bind_kinds(m);
  nb::class_<IntegrationControls>(m, "IntegrationControls", "What an integration is made with; max_steps 0: no limit.")
      .def(
          "__init__",
          [](IntegrationControls *c, double tolerance, unsigned long max_steps, MethodKind method,
             double spectral_radius) { new (c) IntegrationControls{tolerance, max_steps, {method, spectral_radius}}; },
          nb::kw_only(), "tolerance"_a, "max_steps"_a, "method"_a, "spectral_radius"_a);
  nb::class_<Recording>(m, "Recording", "The accepted steps of a run, from which its dense output can be made again.")
      .def(nb::init<>())
      .def("__init__", &make_recording, "times"_a, "states"_a, "method"_a, "spectral_radius"_a, "tolerance"_a,
           "That of an earlier run: times (N,), states (N (n_q + n_v),) one after the other.")
      .def_prop_ro("steps", [](const Recording &r) { return r.times.size(); })
      .def_prop_ro("times", [](const Recording &r) { return as_vector(r.times); })
      .def_prop_ro("states", [](const Recording &r) { return as_vector(r.states); });
  nb::class_<StepHistory>(m, "StepHistory", "What the size of the next step follows from.")
      .def(
          "__init__",
          [](StepHistory *s, double next_step, double usual_step, double reserve, double previous_step,
             double previous_error, bool in_transient) {
            new (s) StepHistory{next_step, usual_step, reserve, previous_step, previous_error, in_transient};
          },
          nb::kw_only(), "next_step"_a, "usual_step"_a, "reserve"_a, "previous_step"_a, "previous_error"_a,
          "in_transient"_a)
      .def_ro("next_step", &StepHistory::next_step)
      .def_ro("usual_step", &StepHistory::usual_step)
      .def_ro("reserve", &StepHistory::reserve)
      .def_ro("previous_step", &StepHistory::previous_step)
      .def_ro("previous_error", &StepHistory::previous_error)
      .def_ro("in_transient", &StepHistory::in_transient);
}
