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
      .def_prop_ro("n_q", &System::n_q, "Length of q.")
      .def_prop_ro("n_v", &System::n_v, "Length of v, a and increments of q.")
      .def_prop_ro("coordinates", &System::n_v, "As n_v.")
      .def_ro("length", &System::length)
      .def_ro("first_coordinate", &System::first_coordinate);
  bind_parts(system);
  bind_evaluations(m, system);
}
