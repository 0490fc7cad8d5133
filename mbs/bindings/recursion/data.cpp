// What a mechanism in joint coordinates is made of: mbs/core/recursion/model.h.
#include "core/recursion/inverse/motion_forces.h"
#include "core/recursion/inverse/observe.h"

#include <nanobind/stl/array.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "bindings/recursion/recursion.h"

namespace {

void bind_planar_data(nb::module_ &m) {
  nb::class_<PlanarMarker>(m, "PlanarMarker")
      .def(nb::init<>())
      .def_rw("position", &PlanarMarker::position)
      .def_rw("angle", &PlanarMarker::angle)
      .def_rw("Phi", &PlanarMarker::Phi)
      .def_rw("K", &PlanarMarker::K);
  nb::class_<PlanarData>(m, "PlanarData")
      .def(nb::init<>())
      .def_rw("mass", &PlanarData::mass)
      .def_rw("inertia", &PlanarData::inertia)
      .def_rw("first_moment", &PlanarData::first_moment)
      .def_rw("stiffness", &PlanarData::stiffness)
      .def_rw("damping", &PlanarData::damping)
      .def_rw("S_bar", &PlanarData::S_bar)
      .def_rw("h", &PlanarData::h)
      .def_rw("j", &PlanarData::j)
      .def_rw("S_tilde", &PlanarData::S_tilde)
      .def_rw("m_xy", &PlanarData::m_xy)
      .def_rw("K", &PlanarData::K)
      .def_rw("markers", &PlanarData::markers);
}

void bind_spatial_data(nb::module_ &m) {
  nb::class_<SpatialMarker>(m, "SpatialMarker")
      .def(nb::init<>())
      .def_rw("position", &SpatialMarker::position)
      .def_rw("triad", &SpatialMarker::triad)
      .def_rw("Phi", &SpatialMarker::Phi)
      .def_rw("K", &SpatialMarker::K)
      .def_rw("turns", &SpatialMarker::turns);
  nb::class_<SpatialData>(m, "SpatialData")
      .def(nb::init<>())
      .def_rw("mass", &SpatialData::mass)
      .def_rw("first_moment", &SpatialData::first_moment)
      .def_rw("J2", &SpatialData::J2)
      .def_rw("stiffness", &SpatialData::stiffness)
      .def_rw("damping", &SpatialData::damping)
      .def_rw("S_bar", &SpatialData::S_bar)
      .def_rw("I_bar", &SpatialData::I_bar)
      .def_rw("S_bar_kl", &SpatialData::S_bar_kl)
      .def_rw("K_s", &SpatialData::K_s)
      .def_rw("K_x", &SpatialData::K_x)
      .def_rw("J_spin", &SpatialData::J_spin)
      .def_rw("h_spin", &SpatialData::h_spin)
      .def_rw("S_spin", &SpatialData::S_spin)
      .def_rw("spin_axis", &SpatialData::spin_axis)
      .def_rw("markers", &SpatialData::markers);
}

void bind_kinds(nb::module_ &m) {
  nb::enum_<JointKind>(m, "JointKind")
      .value("revolute", JointKind::revolute)
      .value("prismatic", JointKind::prismatic)
      .value("screw", JointKind::screw)
      .value("cylindrical", JointKind::cylindrical)
      .value("universal", JointKind::universal)
      .value("spherical", JointKind::spherical)
      .value("planar", JointKind::planar)
      .value("weld", JointKind::weld)
      .value("free", JointKind::free);
  nb::enum_<ConstraintKind>(m, "ConstraintKind")
      .value("point", ConstraintKind::point)
      .value("slide", ConstraintKind::slide)
      .value("dot", ConstraintKind::dot)
      .value("rotation", ConstraintKind::rotation)
      .value("turn", ConstraintKind::turn)
      .value("coordinate", ConstraintKind::coordinate);
}

void bind_constraints(nb::module_ &m) {
  nb::class_<MarkerAt>(m, "MarkerAt", "A marker of a body, or of the ground: body -1.")
      .def(nb::init<int, int>(), "body"_a, "marker"_a)
      .def_ro("body", &MarkerAt::body)
      .def_ro("marker", &MarkerAt::marker)
      .def_rw("only_forces", &MarkerAt::only_forces, "Of a wrench in the plane: its moment is zero at all times.");
  nb::class_<ConstraintModel>(m, "ConstraintModel",
                              "A constraint row between markers a and b; see mbs/core/recursion/model.h.")
      .def(nb::init<>())
      .def_rw("name", &ConstraintModel::name)
      .def_rw("kind", &ConstraintModel::kind)
      .def_rw("a", &ConstraintModel::a)
      .def_rw("b", &ConstraintModel::b)
      .def_rw("f", &ConstraintModel::f)
      .def_rw("g", &ConstraintModel::g)
      .def_rw("coordinate", &ConstraintModel::coordinate);
}

void bind_motions_and_forces(nb::module_ &m) {
  nb::class_<FrameMotion>(m, "FrameMotion", "Motion of a body's frame, global axes.")
      .def_ro("r", &FrameMotion::r)
      .def_ro("a", &FrameMotion::a)
      .def_ro("alpha", &FrameMotion::alpha)
      .def_ro("R", &FrameMotion::R);
  nb::class_<MotionForces>(
      m, "MotionForces",
      "What bodies and joints do to each other, over states (T, …): forces with their moments "
      "about the sections on which they act, global axes; mbs/core/recursion/inverse/motion_forces.h.")
      .def_ro("bodies", &MotionForces::bodies, "(T, 9 bodies) acceleration, angular acceleration, angular velocity.")
      .def_ro("points", &MotionForces::points, "(T, 9 wrenches) the same of sections on which wrenches may act.")
      .def_ro("sections", &MotionForces::sections, "(T, dim sections) all that acts on each of the model's sections.")
      .def_ro("joints", &MotionForces::joints, "(T, dim bodies) what the joint of each does to its outer section.")
      .def_ro("constraints", &MotionForces::constraints, "(T, 2 dim rows) on section a, then on section b of each.")
      .def_ro("wrenches", &MotionForces::wrenches, "(T, dim wrenches) given forces, and those along cut joints.")
      .def_ro("modal", &MotionForces::modal, "(T, n_v) what modes take that forces on sections and actuators supply.")
      .def_ro("rotors", &MotionForces::rotors, "(T, 3 bodies) rate of angular momentum of the rotor in each joint.");
}

} // namespace

void bind_tree_data(nb::module_ &m) {
  bind_planar_data(m), bind_spatial_data(m);
  bind_kinds(m), bind_constraints(m), bind_motions_and_forces(m);
}
