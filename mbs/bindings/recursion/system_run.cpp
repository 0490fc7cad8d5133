// Runs in joint coordinates of systems in the plane: mbs/core/analysis/tree_run.h.
#include "core/analysis/tree_replay.h"
#include "core/analysis/tree_run.h"

#include <nanobind/eigen/dense.h>
#include <nanobind/nanobind.h>
#include <nanobind/stl/function.h>
#include <nanobind/stl/pair.h>
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

void make_both(SystemOnTree *made, const System &system, const PlanarModel &tree, const recursion::Scene &scene,
               std::vector<std::size_t> bodies, const DrivesOnTree &drives, const ReactionsOnTree &reactions) {
  recursion::check_scene(tree, scene);
  SystemOnTree both{system, tree.mechanism, scene, std::move(bodies), drives, reactions};
  both.check();
  new (made) SystemOnTree(std::move(both));
}

void check_state(const SystemOnTree &both, const VectorXd &q, const VectorXd &v) {
  check_size("q", q.size(), both.tree.n_q);
  check_size("v", v.size(), both.tree.n_v);
}

VectorXd state_of(const SystemOnTree &both, const VectorXd &q, const VectorXd &v) {
  check_state(both, q, v);
  VectorXd state(q.size() + v.size());
  state << q, v;
  return state;
}

double violation_of(const SystemOnTree &both, double t, const VectorXd &q, const VectorXd &v, const VectorXd &a) {
  check_state(both, q, v);
  check_size("a", a.size(), both.tree.n_v);
  TreeMotion motion(both.tree, both.scene, t, q.data(), v.data());
  VectorXd solved(a.size());
  motion.evaluate(t, q.data(), v.data(), solved.data());
  recursion::NewtonEuler<recursion::Planar> forces(both.tree);
  forces.accelerate(q.data(), a.data(), motion.workspace());
  return acceleration_residual(both, recursion::targets_at(both.scene, t), a.data(), forces, motion.workspace());
}

recursion::RowMajorMatrix energies_of(const SystemOnTree &both, const recursion::RowMajorMatrix &q,
                                      const recursion::RowMajorMatrix &v) {
  check_size("q columns", q.cols(), both.tree.n_q);
  check_size("v columns", v.cols(), both.tree.n_v);
  check_size("v rows", v.rows(), q.rows());
  return totals_of_states(both.tree, both.scene, q, v).leftCols(4);
}

Run reported_at(const SystemOnTree &both, double t, const VectorXd &q, const VectorXd &v,
                ExternalLoads *external_loads) {
  const VectorXd state = state_of(both, q, v);
  TreeOutputs outputs(both, 1, t, state.data(), external_loads);
  outputs.at(0, t, state.data());
  return {{}, outputs.take(1), {}};
}

Run reported(const SystemOnTree &both, const std::vector<double> &times, const recursion::RowMajorMatrix &states,
             ExternalLoads *external_loads, const std::function<void(std::size_t)> &before) {
  check_size("states", states.cols(), both.state_size());
  check_size("times", static_cast<Index>(times.size()), states.rows());
  if (times.empty())
    throw nb::value_error("times: expected some, found none");
  before(0);
  TreeOutputs outputs(both, times.size(), times.front(), states.row(0).data(), external_loads);
  for (std::size_t i = 0; i < times.size(); ++i) {
    before(i);
    outputs(i, times[i], states.row(static_cast<Index>(i)).data());
  }
  return {{}, outputs.take(times.size()), {}};
}

Run reported_of(const SystemOnTree &both, const std::vector<double> &times, const recursion::RowMajorMatrix &states,
                ExternalLoads *external_loads) {
  return reported(both, times, states, external_loads, [](std::size_t) {});
}

Run reported_under(const SystemOnTree &both, const std::vector<double> &times, const recursion::RowMajorMatrix &states,
                   std::size_t motors, std::vector<HeldCommands::Patches> patches,
                   const recursion::RowMajorMatrix &held) {
  check_size("held commands", held.rows(), states.rows());
  HeldCommands commands(motors, std::move(patches));
  return reported(both, times, states, &commands,
                  [&](std::size_t i) { commands.set(held.row(static_cast<Index>(i)).transpose()); });
}

Run run_tree(const SystemOnTree &both, const std::vector<double> &times, const VectorXd &q, const VectorXd &v,
             const IntegrationControls &controls, const std::function<bool(double)> &carry_on,
             ExternalLoads *external_loads, Recording *recording, recursion::TreeCheckpoint *checkpoint,
             Samples *samples) {
  const VectorXd state = state_of(both, q, v);
  const nb::gil_scoped_release unlocked;
  std::optional<SteeredTree> steering;
  if (external_loads)
    steering.emplace(both, *external_loads);
  TreeMotion motion(both.tree, both.scene, times.front(), q.data(), v.data(), nullptr, steering ? &*steering : nullptr);
  std::optional<recursion::Motors<Planar>> motors;
  if (!both.reactions.motors.empty())
    motion.judge(motors.emplace(both.driven()));
  if (checkpoint && checkpoint->integration.has_begun()) {
    check_size("state of the checkpoint", checkpoint->integration.state.size(), state.size());
    motion.go_on(checkpoint->history);
  }
  TreeOutputs outputs(both, times.size(), times.front(), state.data(), external_loads);
  Run found = run(motion, times, state, controls, outputs, locked(carry_on), recording, nullptr,
                  checkpoint ? &checkpoint->integration : nullptr, samples);
  if (checkpoint)
    checkpoint->history = motion.history();
  return found;
}

using Controller = std::function<VectorXd(std::size_t, double, const VectorXd &)>;

Run run_tree_sampled(const SystemOnTree &both, const std::vector<double> &times, const VectorXd &q, const VectorXd &v,
                     const IntegrationControls &controls, const std::function<bool(double)> &carry_on,
                     std::size_t motors, std::vector<HeldCommands::Patches> patches, const VectorXd &first_command,
                     Sensing &sensing, const std::vector<double> &samples, double delay, const Controller &controller,
                     Samples *between) {
  const VectorXd state = state_of(both, q, v);
  const nb::gil_scoped_release unlocked;
  HeldCommands commands(motors, std::move(patches));
  commands.set(first_command);
  SteeredTree steering(both, commands);
  TreeMotion motion(both.tree, both.scene, times.front(), q.data(), v.data(), nullptr, &steering);
  TreeOutputs outputs(both, times.size(), times.front(), state.data(), &commands);
  return run_sampled(motion, times, state, controls, outputs, commands, sensing, {samples, delay, locked(controller)},
                     locked(carry_on), between);
}

void bind_drives(nb::module_ &m) {
  nb::class_<DrivesOnTree>(m, "DrivesOnTree", "Where drives and modal forces of a system act in a tree.")
      .def(
          "__init__",
          [](DrivesOnTree *made, std::vector<int> modes) { new (made) DrivesOnTree{{}, {}, std::move(modes), {}}; },
          "modes"_a, "Of each body of the system the first index of its modes in v.")
      .def(
          "add_along",
          [](DrivesOnTree &d, std::size_t drive, int coordinate, double share) {
            d.along.push_back({drive, coordinate, share});
          },
          "drive"_a, "coordinate"_a, "share"_a, "`share` times the drive acts along v[coordinate].")
      .def(
          "add_along_cut",
          [](DrivesOnTree &d, std::size_t drive, int joint) { d.along_cuts.push_back({drive, joint}); }, "drive"_a,
          "joint"_a, "The drive acts along a joint of add_cut_joint, by its number.")
      .def(
          "add_at_point",
          [](DrivesOnTree &d, std::size_t drive, int wrench, int component, double share) {
            d.at_points.push_back({drive, wrench, component, share});
          },
          "drive"_a, "wrench"_a, "component"_a, "share"_a,
          "`share` times the drive is a component of (force, moment), global axes, on a wrench of the tree.");
}

void bind_reactions(nb::module_ &m) {
  using Component = ReactionsOnTree::Component;
  nb::enum_<Component>(m, "JointComponent", "Of what a joint transmits: mbs/core/analysis/system_on_tree.h.")
      .value("x", Component::x)
      .value("y", Component::y)
      .value("moment", Component::moment)
      .value("across", Component::across);
  nb::class_<ReactionsOnTree>(m, "ReactionsOnTree", "What constraints and motors of a system are in a tree.")
      .def(nb::init<>())
      .def(
          "add_row",
          [](ReactionsOnTree &r, int constraint, int row, double sign, bool is_trajectory) {
            r.rows.push_back({constraint, row, sign, is_trajectory});
          },
          "constraint"_a, "row"_a, "sign"_a, "is_trajectory"_a,
          "The multiplier of a constraint is `sign` times that of a row.")
      .def(
          "add_joint",
          [](ReactionsOnTree &r, int constraint, int node, Component component, bool backwards) {
            r.joints.push_back({constraint, node, component, backwards});
          },
          "constraint"_a, "node"_a, "component"_a, "backwards"_a,
          "The constraint is one of the joint that carries a node, its first side where `backwards`.")
      .def(
          "add_weight",
          [](ReactionsOnTree &r, int constraint, double value) { r.weights.push_back({constraint, value}); },
          "constraint"_a, "value"_a, "The multiplier of a constraint that holds a rotor against gravity; N.")
      .def(
          "add_motor",
          [](ReactionsOnTree &r, int coordinate, double sign, bool turns_frames) {
            r.motors.push_back({coordinate, sign, turns_frames, -1});
          },
          "coordinate"_a, "sign"_a, "turns_frames"_a,
          "A motor along `sign` v[coordinate], or between the frames of the bodies there.")
      .def(
          "add_motor_along_cut", [](ReactionsOnTree &r, int joint) { r.motors.push_back({-1, 1, false, joint}); },
          "joint"_a, "A motor along a joint of add_cut_joint, by its number.");
}

void make_actuation(TreeActuation *made, const SystemOnTree &both, const Recording &recording) {
  if (recording.times.size() < 2 ||
      static_cast<Index>(recording.states.size()) != both.state_size() * static_cast<Index>(recording.times.size()))
    throw nb::value_error("recording: expected one of this tree, with a step");
  new (made) TreeActuation(both, recording);
}

} // namespace

void bind_system_run(nb::module_ &m) {
  bind_drives(m);
  bind_reactions(m);
  nb::class_<SystemOnTree>(m, "SystemOnTree", "A system in the plane, and a tree of the same bodies.")
      .def("__init__", &make_both, "system"_a, "tree"_a, "scene"_a, "bodies"_a, "drives"_a, "reactions"_a,
           nb::keep_alive<1, 2>(), nb::keep_alive<1, 3>(), nb::keep_alive<1, 4>(),
           "bodies: number in the system of each of the tree's.")
      .def("energies", &energies_of, "q"_a, "v"_a,
           "Kinetic, strain, gravitational energy and dissipated power (T, 4) of states q, v (T, n_v) of the tree.")
      .def("at", &reported_at, "t"_a, "q"_a, "v"_a, "external_loads"_a = nb::none(),
           "What a run reports of a state q, v (n_v) of the tree, which is not moved onto its rows.")
      .def("outputs", &reported_of, "times"_a, "states"_a, "external_loads"_a = nb::none(),
           "What a run reports of states (T, n_q + n_v) of the tree near its rows, at times (T,).")
      .def("outputs_under", &reported_under, "times"_a, "states"_a, "motors"_a, "patches"_a, "commands"_a,
           "As `outputs`, under commands (T, inputs) of motors and patches.")
      .def_prop_ro("driven", &SystemOnTree::driven, nb::keep_alive<0, 1>(), "The tree with motors and path.")
      .def("acceleration_violation", &violation_of, "t"_a, "q"_a, "v"_a, "a"_a,
           "Largest violation of C_ddot = 0 by accelerations a (n_v) of the tree, relative to the terms that cancel.");
  bind_prescribed(m);
  nb::class_<TreeActuation, ActuationSource>(m, "TreeActuation", "From the dense output of a recorded run of a tree.")
      .def("__init__", &make_actuation, "both"_a, "recording"_a, nb::keep_alive<1, 2>(), nb::keep_alive<1, 3>());
  m.def("run_tree", &run_tree, "both"_a, nb::kw_only(), "times"_a, "q"_a, "v"_a, "controls"_a, "carry_on"_a,
        "external_loads"_a = nb::none(), "recording"_a = nb::none(), "checkpoint"_a = nb::none(),
        "samples"_a = nb::none(),
        "Integrates the motion from (q, v) of the tree, or on from a checkpoint, which it moves, and reports it at "
        "`times`.\n"
        "Recording, checkpoint and samples are of the tree, too.");
  m.def("run_tree_sampled", &run_tree_sampled, "both"_a, nb::kw_only(), "times"_a, "q"_a, "v"_a, "controls"_a,
        "carry_on"_a, "motors"_a, "patches"_a, "first_command"_a, "sensing"_a, "samples"_a, "delay"_a, "controller"_a,
        "between"_a = nb::none(), "As `run_tree`, under commands that `controller`(k, t, readings) gives at samples.");
}
