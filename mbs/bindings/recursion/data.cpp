// What a mechanism in joint coordinates is made of: mbs/core/recursion/model.h.
#include "core/recursion/inverse/motion_forces.h"
#include "core/recursion/inverse/observe.h"

#include <nanobind/stl/array.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "bindings/recursion/recursion.h"

namespace {

void bind_constraints(nb::module_ &m) {
  nb::class_<MarkerAt>(m, "MarkerAt", "A marker of a body, or of the ground: body -1.")
      .def(nb::init<int, int>(), "body"_a, "marker"_a)
      .def_ro("body", &MarkerAt::body)
      .def_ro("marker", &MarkerAt::marker)
      .def_rw("only_forces", &MarkerAt::only_forces, "Whether the moment of a wrench in the plane is always zero.");
  bind_fields(nb::class_<ConstraintModel>(
      m, "ConstraintModel", "A constraint equation between markers a and b: mbs/core/recursion/model.h."));
}

void bind_motions_and_forces(nb::module_ &m) {
  bind_fields(nb::class_<FrameMotion>(m, "FrameMotion", "Motion of a body's frame, global axes."));
  bind_fields(nb::class_<MotionForces>(
      m, "MotionForces",
      "Forces between bodies and in joints over states: mbs/core/recursion/inverse/motion_forces.h."));
}

} // namespace

void bind_tree_data(nb::module_ &m) {
  bind_fields(nb::class_<PlanarMarker>(m, "PlanarMarker")), bind_fields(nb::class_<PlanarData>(m, "PlanarData"));
  bind_fields(nb::class_<SpatialMarker>(m, "SpatialMarker")), bind_fields(nb::class_<SpatialData>(m, "SpatialData"));
  nb::enum_<JointKind> joints(m, "JointKind");
#define FFROBOT_VALUE(name, Joint) joints.value(#name, JointKind::name);
  FFROBOT_JOINTS(FFROBOT_VALUE)
  joints.def_prop_ro("q_count", [](JointKind kind) { return spatial_shape(kind).q_count(); });
  joints.def_prop_ro("axes", [](JointKind kind) {
    const Freedoms free = spatial_shape(kind).freedoms;
    return std::vector(free.component, free.component + free.count);
  });
  joints.def_prop_ro(
      "is_planar", [](JointKind kind) { return of_kind(kind, [](auto joint) { return requires { joint.planar; }; }); });
  bind_values(nb::enum_<ConstraintKind>(m, "ConstraintKind"),
              FFROBOT_VALUES(ConstraintKind, point, slide, dot, rotation, turn, coordinate));
  bind_constraints(m), bind_motions_and_forces(m);
}
