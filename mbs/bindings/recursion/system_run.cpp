// Runs in joint coordinates of systems in the plane: mbs/core/analysis/tree_run.h.
#include "core/analysis/tree_run.h"

#include <nanobind/eigen/dense.h>
#include <nanobind/nanobind.h>
#include <nanobind/stl/function.h>
#include <nanobind/stl/vector.h>

#include <optional>

#include "bindings/recursion/tree_run.h"

namespace nb = nanobind;
using namespace nb::literals;
using namespace ffrobot;
using Eigen::Index;
using Eigen::VectorXd;
using recursion::Planar;

namespace {

using PlanarModel = recursion::Model<Planar>;

void check_drives(const System &system, const PlanarModel &tree, const DrivesOnTree &drives) {
  const auto check_drive = [&](std::size_t drive) {
    recursion::check_index("drive", static_cast<int>(drive), system.drives.size());
  };
  for (const auto &[drive, coordinate, share] : drives.along)
    check_drive(drive), recursion::check_index("coordinate", coordinate, static_cast<std::size_t>(tree.mechanism.n_v));
  for (const auto &[drive, wrench, component, share] : drives.at_points) {
    check_drive(drive);
    recursion::check_index("wrench", wrench, tree.mechanism.wrenches.size());
    recursion::check_index("component", component, Planar::dim);
  }
  check_size("modes", static_cast<Index>(drives.modes.size()), static_cast<Index>(system.bodies.size()));
  for (std::size_t b = 0; b < drives.modes.size(); ++b)
    recursion::check_index("modes", drives.modes[b],
                           static_cast<std::size_t>(tree.mechanism.n_v - system.bodies[b].modes() + 1));
}

Run run_tree(const System &system, const PlanarModel &tree, const recursion::Scene &scene,
             std::vector<std::size_t> bodies, const DrivesOnTree &drives, const std::vector<double> &times,
             const VectorXd &q, const VectorXd &v, const IntegrationControls &controls,
             const std::function<bool(double)> &carry_on, ExternalLoads *external_loads,
             ActuatorForces *actuator_forces, Recording *recording, recursion::TreeCheckpoint *checkpoint) {
  tree.check_state(q, v);
  recursion::check_scene(tree, scene);
  check_drives(system, tree, drives);
  const nb::gil_scoped_release unlocked;
  std::optional<SteeredTree> steering;
  if (external_loads)
    steering.emplace(system, *external_loads, drives);
  recursion::RecursiveMotion<Planar> motion(tree.mechanism, scene, times.front(), q.data(), v.data(), nullptr,
                                            steering ? &*steering : nullptr);
  if (checkpoint && checkpoint->integration.has_begun()) {
    check_size("state of the checkpoint", checkpoint->integration.state.size(), q.size() + v.size());
    motion.go_on(checkpoint->history);
  }
  const auto ask = [&](double t) {
    const nb::gil_scoped_acquire locked;
    return carry_on(t);
  };
  Run found = run(motion, {system, tree.mechanism, std::move(bodies)}, times, q, v, controls,
                  {system, times.size(), external_loads, actuator_forces}, ask, recording,
                  checkpoint ? &checkpoint->integration : nullptr);
  if (checkpoint)
    checkpoint->history = motion.history();
  return found;
}

} // namespace

void bind_system_run(nb::module_ &m) {
  nb::class_<DrivesOnTree>(m, "DrivesOnTree", "Where drives and modal forces of a system act in a tree.")
      .def(
          "__init__",
          [](DrivesOnTree *made, std::vector<int> modes) { new (made) DrivesOnTree{{}, {}, std::move(modes)}; },
          "modes"_a, "Of each body of the system the first index of its modes in v.")
      .def(
          "add_along",
          [](DrivesOnTree &d, std::size_t drive, int coordinate, double share) {
            d.along.push_back({drive, coordinate, share});
          },
          "drive"_a, "coordinate"_a, "share"_a, "`share` times the drive acts along v[coordinate].")
      .def(
          "add_at_point",
          [](DrivesOnTree &d, std::size_t drive, int wrench, int component, double share) {
            d.at_points.push_back({drive, wrench, component, share});
          },
          "drive"_a, "wrench"_a, "component"_a, "share"_a,
          "`share` times the drive is a component of (force, moment), global axes, on a wrench of the tree.");
  m.def("run_tree", &run_tree, nb::kw_only(), "system"_a, "tree"_a, "scene"_a, "bodies"_a, "drives"_a, "times"_a, "q"_a,
        "v"_a, "controls"_a, "carry_on"_a, "external_loads"_a = nb::none(), "actuator_forces"_a = nb::none(),
        "recording"_a = nb::none(), "checkpoint"_a = nb::none(),
        "As `run`, but integrates a tree of the same bodies from (q, v) of its own; bodies: number in the system of\n"
        "each of the tree's.");
}
