#include <array>
#include <tuple>

#include <nanobind/eigen/dense.h>
#include <nanobind/nanobind.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/vector.h>

#include "bindings/bindings.h"
#include "bindings/system/system.h"

namespace nb = nanobind;
using namespace nb::literals;
using namespace ffrobot;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::VectorXd;

namespace {

void add_body(System &system, double mass, double inertia, const Vector2d &first_moment, const VectorXd &stiffness,
              const MatrixXd &damping, const MatrixXd &W, const VectorXd &j, const MatrixXd &S_tilde,
              const MatrixXd &m_xy, const std::vector<Vector2d> &marker_positions,
              const std::vector<MatrixXd> &second_order, const std::array<MatrixXd, 4> &geometric_stiffness) {
  const auto n = stiffness.size();
  check_size("W rows", W.rows(), 3 + 3 * static_cast<Eigen::Index>(marker_positions.size()));
  check_size("W columns", W.cols(), n);
  for (const auto &[name, size] :
       {std::pair("damping", damping.rows()), {"j", j.size()}, {"S_tilde", S_tilde.rows()}, {"m_xy", m_xy.rows()}})
    if (size)
      check_size(name, size, n);
  PlanarBody body{mass, inertia, first_moment, stiffness, damping, W, j, S_tilde, m_xy, marker_positions, {}, {}};
  for (std::size_t row = 0; row < second_order.size(); ++row)
    if (second_order[row].size()) {
      check_size("second_order", second_order[row].rows(), n);
      body.second_order.push_back({3 + static_cast<Eigen::Index>(row), second_order[row]});
    }
  for (const auto &K : geometric_stiffness)
    if (K.size())
      check_size("geometric_stiffness", K.rows(), n);
  stiffen(body, geometric_stiffness);
  system.bodies.push_back(std::move(body));
}

void add_constraint(System &system, const Measure &row, const TimeFunction &target) {
  system.constraints.push_back({row, target});
}

void add_rotor(System &system, const Measure &row, double inertia) { system.rotors.push_back({row, inertia}); }

void add_friction(System &system, const Measure &row, double viscous, double coulomb, double speed) {
  system.drives.push_back({row, Constant(0.0), {viscous, coulomb, speed}});
}

void add_spring(System &system, const Measure &motor, const Measure &joint, double stiffness, double damping) {
  system.springs.push_back({motor, joint, stiffness, damping});
}

void add_drive(System &system, const Measure &row, const TimeFunction &magnitude) {
  system.drives.push_back({row, magnitude});
}

void add_modal_drive(System &system, int body, const VectorXd &vector, const TimeFunction &magnitude) {
  system.modal_drives.push_back({body, vector, magnitude});
}

void add_state_force(System &system, const MarkerReference &marker, const StateFunction &function) {
  system.state_forces.push_back({marker, function});
}

} // namespace

void bind_parts(nb::class_<System> &system) {
  system
      .def("add_body", &add_body, "mass"_a, "inertia"_a, "first_moment"_a, "stiffness"_a, "damping"_a, "W"_a, "j"_a,
           "S_tilde"_a, "m_xy"_a, "marker_positions"_a, "second_order"_a, "geometric_stiffness"_a,
           "With terms that vanish empty; see core/body/planar_body.h for shapes and units.")
      .def("add_constraint", &add_constraint, "row"_a, "target"_a)
      .def("add_rotor", &add_rotor, "row"_a, "inertia"_a)
      .def("add_friction", &add_friction, "row"_a, "viscous"_a, "coulomb"_a, "speed"_a)
      .def("add_spring", &add_spring, "motor"_a, "joint"_a, "stiffness"_a, "damping"_a)
      .def("add_drive", &add_drive, "row"_a, "magnitude"_a)
      .def("add_modal_drive", &add_modal_drive, "body"_a, "vector"_a, "magnitude"_a)
      .def("add_state_force", &add_state_force, "marker"_a, "function"_a)
      .def("finish", &System::finish);
}
