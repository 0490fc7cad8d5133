#include "bindings/system/system.h"

#include <nanobind/eigen/dense.h>
#include <nanobind/nanobind.h>
#include <nanobind/stl/vector.h>

#include "bindings/bindings.h"

namespace nb = nanobind;
using namespace nb::literals;
using namespace ffrobot;

void bind_system(nb::module_ &m) {
  nb::class_<System> system(m, "System", "Bodies, constraints and drives; call finish() once after adding them.");
  system
      .def(
          "__init__", [](System *s, const Eigen::Vector2d &gravity) { (new (s) System())->gravity = gravity; },
          "gravity"_a)
      .def_ro("coordinates", &System::coordinates, "Length of q, v and a.")
      .def_ro("length", &System::length)
      .def_ro("first_coordinate", &System::first_coordinate);
  bind_parts(system);
  bind_evaluations(system);
}
