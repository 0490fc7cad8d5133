#include "core/constraint/measure.h"
#include "core/constraint/state_force.h"

#include <nanobind/eigen/dense.h>
#include <nanobind/nanobind.h>
#include <nanobind/stl/function.h>
#include <nanobind/stl/tuple.h>

#include <cstdint>
#include <functional>
#include <tuple>

#include "bindings/bindings.h"

namespace nb = nanobind;
using namespace nb::literals;
using namespace ffrobot;
using Eigen::Vector2d;

namespace {

StateFunction python_force(
    const std::function<std::tuple<double, double, double>(double, double, double, double, double)> &function) {
  return {[function](double t, const double *position, const double *rate, double *force) {
    std::tie(force[0], force[1], force[2]) = function(t, position[0], position[1], rate[0], rate[1]);
  }};
}

StateFunction compiled_force(std::uintptr_t address) { return {reinterpret_cast<StateFunction::Compiled>(address)}; }

} // namespace

void bind_constraint(nb::module_ &m) {
  nb::class_<MarkerReference>(m, "Marker", "A marker of a body (body index, marker index), or a point of the ground.")
      .def(nb::init<int, int, Vector2d>(), "body"_a, "marker"_a, "ground"_a)
      .def_ro("body", &MarkerReference::body)
      .def_ro("marker", &MarkerReference::marker);
  nb::enum_<MeasureKind>(m, "MeasureKind", "What is measured between two markers.")
      .value("x", MeasureKind::x)
      .value("y", MeasureKind::y)
      .value("angle", MeasureKind::angle)
      .value("slide", MeasureKind::slide)
      .value("gear", MeasureKind::gear);
  nb::class_<Measure>(m, "Measure", "A scalar function of the motion of two markers: that of b relative to a.")
      .def(nb::init<MeasureKind, MarkerReference, MarkerReference, Vector2d, Vector2d, double>(), "kind"_a, "a"_a,
           "b"_a, "direction"_a, "gear_ratios"_a, "offset"_a)
      .def_ro("kind", &Measure::kind)
      .def_ro("a", &Measure::a)
      .def_ro("b", &Measure::b);
  nb::class_<StateFunction>(m, "StateFunction", "A force of the user's, of time, position and velocity.")
      .def(
          "__call__",
          [](const StateFunction &function, double t, double x, double y, double angle, double v_x, double v_y,
             double angular_velocity) {
            const double position[] = {x, y, angle}, rate[] = {v_x, v_y, angular_velocity};
            double force[3] = {};
            function.call(t, position, rate, force);
            return std::make_tuple(force[0], force[1], force[2]);
          },
          "t"_a, "x"_a, "y"_a, "angle"_a, "v_x"_a, "v_y"_a, "angular_velocity"_a, "(x, y, moment): N, N m.")
      .def_static("python", &python_force, "function"_a, "A callable of t, x, y, v_x, v_y that returns (x, y, moment).")
      .def_static(
          "compiled", &compiled_force, "address"_a,
          "Address of a C function void(double t, const double *x_y_angle, const double *rates, double *x_y_moment).");
}
