#include "core/analysis/servo.h"

#include <nanobind/eigen/dense.h>
#include <nanobind/nanobind.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/vector.h>

#include "bindings/bindings.h"

namespace nb = nanobind;
using namespace nb::literals;
using namespace ffrobot;

void bind_servo(nb::module_ &m) {
  nb::class_<InternalDynamics>(m, "InternalDynamics", "Derivatives of the residual, each (N, n n) row after row.")
      .def_ro("M", &InternalDynamics::M)
      .def_ro("D", &InternalDynamics::D)
      .def_ro("K", &InternalDynamics::K);

  nb::class_<ServoConstraint>(m, "ServoConstraint", "Inverse dynamics of a path with joint motors alone.")
      .def(nb::init<const System &, std::vector<Measure>, const System &, std::vector<std::size_t>, double,
                    std::vector<TimeFunction>, Eigen::VectorXd>(),
           "path"_a, "motors"_a, "driven"_a, "motor_constraint"_a, "factor"_a, "offset"_a, "guess"_a,
           nb::keep_alive<1, 2>(), nb::keep_alive<1, 4>())
      .def("residuals", &servo_residuals, "times"_a, "p"_a, "p_dot"_a, "p_ddot"_a,
           "Modal forces r (N, n) that motors do not supply; NaN where no position is found.")
      .def("derivatives", &servo_derivatives, "times"_a, "p"_a, "p_dot"_a, "p_ddot"_a,
           "M, D, K of the internal dynamics: derivatives of r by p_ddot, p_dot, p.")
      .def("outputs", &servo_outputs, "times"_a, "shape"_a, "resolver"_a,
           "Motion and forces for p(t), shape[body][mode].");

  nb::class_<ServoActuation, ActuationSource>(m, "ServoActuation", "Solved anew at every time.")
      .def(nb::init<const System &, ServoConstraint, std::vector<ModalShape>, std::vector<bool>, ActuatorForces>(),
           "driven"_a, "servo"_a, "shape"_a, "is_motor"_a, "resolver"_a, nb::keep_alive<1, 2>(),
           nb::keep_alive<1, 3>());
}
