#include "core/analysis/fcid.h"
#include "core/analysis/replay.h"
#include "core/analysis/servo.h"

#include <nanobind/eigen/dense.h>
#include <nanobind/nanobind.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/vector.h>

#include "bindings/analysis/analysis.h"
#include "bindings/bindings.h"

namespace nb = nanobind;
using namespace nb::literals;
using namespace ffrobot;
using Eigen::VectorXd;

namespace {

void bind_fully_constrained(nb::module_ &m) {
  nb::class_<FcidOutputs>(m, "FcidOutputs", "Fully constrained inverse dynamics, one row per time reached.")
      .def_ro("completed", &FcidOutputs::completed)
      .def_ro("reached", &FcidOutputs::reached)
      .def_ro("q", &FcidOutputs::q)
      .def_ro("v", &FcidOutputs::v)
      .def_ro("a", &FcidOutputs::a)
      .def_ro("multipliers", &FcidOutputs::lambda)
      .def_ro("shape_force", &FcidOutputs::shape_force)
      .def_ro("tau", &FcidOutputs::tau)
      .def_ro("F_p", &FcidOutputs::F_p)
      .def_ro("residual", &FcidOutputs::residual);
  m.def("fully_constrained", &fully_constrained, "system"_a, "times"_a, "shape"_a, "guess"_a,
        "actuator_forces"_a.none(),
        "Motion and forces for prescribed trajectories and modal coordinates p(t), shape[body][mode].");
  m.def("static_shape", &static_shape, "system"_a, "times"_a, "guess"_a, "actuator_forces"_a.none(),
        "Shapes (T, modes of all bodies) that need no modal forces at rest; fewer rows where one is not found.");
}

void bind_servo(nb::module_ &m) {
  nb::class_<InternalDynamics>(m, "InternalDynamics", "Derivatives of the residual, each (N, n n) row after row.")
      .def_ro("M", &InternalDynamics::M)
      .def_ro("D", &InternalDynamics::D)
      .def_ro("K", &InternalDynamics::K);

  nb::class_<ServoConstraint>(m, "ServoConstraint", "Inverse dynamics of a path with joint motors alone.")
      .def(nb::init<const System &, std::vector<Measure>, const System &, std::vector<std::size_t>, double,
                    std::vector<TimeFunction>, std::vector<double>, RowMajorMatrix>(),
           "path"_a, "motors"_a, "driven"_a, "motor_constraint"_a, "factor"_a, "offset"_a, "near_times"_a, "near"_a,
           nb::keep_alive<1, 2>(), nb::keep_alive<1, 4>())
      .def("residuals", &servo_residuals, "times"_a, "p"_a, "p_dot"_a, "p_ddot"_a,
           "Modal forces r (N, n) that motors do not supply; NaN where no position is found.")
      .def("derivatives", &servo_derivatives, "times"_a, "p"_a, "p_dot"_a, "p_ddot"_a,
           "M, D, K of the internal dynamics: derivatives of r by p_ddot, p_dot, p.")
      .def("outputs", &servo_outputs, "times"_a, "shape"_a, "actuator_forces"_a,
           "Motion and forces for p(t), shape[body][mode].");

  nb::class_<ServoActuation, ActuationSource>(m, "ServoActuation", "Solved anew at every time.")
      .def(nb::init<const System &, ServoConstraint, std::vector<ModalShape>, std::vector<bool>, ActuatorForces>(),
           "driven"_a, "servo"_a, "shape"_a, "is_motor"_a, "actuator_forces"_a, nb::keep_alive<1, 2>(),
           nb::keep_alive<1, 3>());
}

void bind_replay(nb::module_ &m) {
  nb::class_<RecordedActuation, ActuationSource>(m, "RecordedActuation", "From the dense output of a recorded run.")
      .def(nb::init<const System &, const Recording &, std::vector<bool>, std::optional<ActuatorForces>>(), "system"_a,
           "recording"_a, "is_trajectory"_a, "actuator_forces"_a.none(), nb::keep_alive<1, 2>(),
           nb::keep_alive<1, 3>());
  nb::class_<FullyConstrainedActuation, ActuationSource>(m, "FullyConstrainedActuation", "Solved anew at every time.")
      .def(nb::init<const System &, std::vector<ModalShape>, VectorXd, std::vector<bool>,
                    std::optional<ActuatorForces>>(),
           "system"_a, "shape"_a, "guess"_a, "is_trajectory"_a, "actuator_forces"_a.none(), nb::keep_alive<1, 2>());
}

} // namespace

void bind_inverse(nb::module_ &m) {
  bind_fully_constrained(m);
  bind_servo(m);
  bind_replay(m);
}
