// Motions of mechanisms in joint coordinates: mbs/core/recursion/motion/motion.h.
#include "core/recursion/inverse/motors.h"

#include <nanobind/stl/complex.h>
#include <nanobind/stl/function.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include "bindings/recursion/tree_run.h"

namespace {

template <class Space>
TreeRun motion_of(const Model<Space> &model, const Scene &scene, const std::vector<double> &times, const VectorXd &q,
                  const VectorXd &v, const IntegrationControls &controls, const std::function<bool(double)> &carry_on,
                  TreeCheckpoint *checkpoint, Samples *samples, Recording *recording, Replay *replay,
                  const DrivenMechanism<Space> *judged) {
  model.check_state(q, v);
  check_scene(model, scene);
  if (replay)
    check_replay(model, *replay);
  const nb::gil_scoped_release unlocked;
  RecursiveMotion<Space> motion(model.mechanism, scene, times.front(), q.data(), v.data(), nullptr, replay);
  RecursiveMotion<Space> reader(model.mechanism, scene, times.front(), q.data(), v.data(), nullptr, replay);
  std::optional<Motors<Space>> motors;
  if (judged && !judged->motors.empty())
    motion.judge(motors.emplace(*judged));
  if (checkpoint && checkpoint->integration.has_begun()) {
    check_size("state of the checkpoint", checkpoint->integration.state.size(), q.size() + v.size());
    motion.go_on(checkpoint->history);
  }
  return integrated(model, scene, motion, reader, times, q, v, controls, carry_on,
                    {.recording = recording, .samples = samples}, checkpoint, replay);
}

template <class Space>
TreeRun outputs_of(const Model<Space> &model, const Scene &scene, const std::vector<double> &times, const Rows &states,
                   Replay *replay) {
  if (replay)
    check_replay(model, *replay);
  return outputs_at(model, scene, times, states, nullptr, replay, [](Index) {});
}

// x (n_v) of N x + C_q^T nu = r, C_q x = c at (q, v); complex factors know no c
template <class Space, class Scalar>
Matrix<Scalar, Dynamic, 1> newton_step(const Model<Space> &model, const Scene &scene, double t, const VectorXd &q,
                                       const VectorXd &v, Scalar damping_factor, Scalar stiffness_factor,
                                       const Matrix<Scalar, Dynamic, 1> &r, const VectorXd &c) {
  model.check_state(q, v);
  check_scene(model, scene);
  RecursiveMotion<Space> motion(model.mechanism, scene, t, q.data(), v.data());
  check_size("r", r.size(), motion.n_stiff());
  check_size("c", c.size(), motion.constraints());
  VectorXd state(q.size() + v.size()), z(motion.size());
  state << q, v;
  motion.local().set_centre(state.data());
  motion.local().from_state(state.data(), z.data());
  motion.linearise(t, z.data());
  motion.factorise(damping_factor, stiffness_factor);
  Matrix<Scalar, Dynamic, 1> x(v.size());
  if constexpr (std::is_same_v<Scalar, double>)
    motion.solve(r.data(), c.data(), x.data());
  else
    motion.solve(r.data(), x.data());
  return x;
}

template <class Space> void bind_motion(nb::module_ &m) {
  const auto bind_newton_step = [&](auto step) {
    m.def("tree_newton_step", step, "model"_a, "scene"_a, "t"_a, "q"_a, "v"_a, "damping_factor"_a, "stiffness_factor"_a,
          "r"_a, "c"_a,
          "For tests: x of (M + damping_factor D + stiffness_factor K) x + C_q^T nu = r, C_q x = c, zero where factors "
          "are complex.");
  };
  bind_newton_step(&newton_step<Space, double>);
  bind_newton_step(&newton_step<Space, std::complex<double>>);
  m.def(
      "tree_motion", &motion_of<Space>, "model"_a, "scene"_a, "times"_a, "q"_a, "v"_a, "controls"_a, "carry_on"_a,
      "checkpoint"_a = nb::none(), "samples"_a = nb::none(), "recording"_a = nb::none(), "replay"_a = nb::none(),
      "judged"_a = nb::none(),
      "Integrate from (q, v) at the first of `times`, or from a checkpoint, which is moved, with outputs at `times` "
      "(s);\nthose before the checkpoint are undefined. carry_on(t), called now and then, ends the run where it is\n"
      "False. A recording keeps the steps; a replay acts beside the scene. Errors of the motors of `judged`, the same\n"
      "mechanism, are bounded, too.");
  m.def("tree_outputs", &outputs_of<Space>, "model"_a, "scene"_a, "times"_a, "states"_a, "replay"_a = nb::none(),
        "Outputs at known states (T, n_q + n_v) at `times` (s).");
}

void bind_checkpoint(nb::module_ &m) {
  auto checkpoint = nb::class_<TreeCheckpoint>(m, "TreeCheckpoint",
                                               "Where a run has stopped, and all that its next step depends on.");
  checkpoint.def(nb::init<>())
      .def_prop_ro("time", [](const TreeCheckpoint &c) { return c.integration.time; })
      .def_prop_ro("state_peaks", [](const TreeCheckpoint &c) { return c.history.peaks.state; })
      .def_prop_ro("force_peaks", [](const TreeCheckpoint &c) { return c.history.peaks.force; });
  bind_bytes(checkpoint);
}

void bind_report(nb::class_<TreeRun> run) {
  run.def_ro("status", &TreeRun::status)
      .def_ro("steps", &TreeRun::steps)
      .def_ro("rejected", &TreeRun::rejected)
      .def_ro("evaluations", &TreeRun::evaluations)
      .def_ro("time_reached", &TreeRun::time)
      .def_ro("last_step", &TreeRun::last_step)
      .def_ro("last_error", &TreeRun::last_error)
      .def_ro("rounding", &TreeRun::rounding, "Largest error by round-off, in the unit of the tolerance.")
      .def_prop_ro(
          "changes",
          [](const TreeRun &r) {
            std::vector<std::tuple<double, MethodKind, MethodKind, double>> changes;
            for (const auto &[time, from, to, mean_step] : r.changes)
              changes.emplace_back(time, from, to, mean_step);
            return changes;
          },
          "Of integrators: (time, from, to, mean step before) of each.")
      .def_ro("step_ends", &TreeRun::step_ends,
              "Ends (s) of steps, with keep_steps of the controls; empty where they cannot be repeated.");
}

void bind_run(nb::module_ &m) {
  auto run = nb::class_<TreeRun>(m, "TreeRun", "A motion in joint coordinates at outputs, as far as it got.");
  bind_report(run);
  run.def_ro("least_ratio", &TreeRun::least_ratio,
             "Least ratio of singular values in watched postures, 1 without; mbs/core/recursion/motion/mobility.h.")
      .def_ro("singular_at", &TreeRun::singular_at, "Time of the least ratio, s.")
      .def_ro("singular_posture", &TreeRun::singular_posture, "(n_q) q then; empty without a watch.")
      .def_prop_ro(
          "ranges",
          [](const TreeRun &r) {
            std::vector<std::tuple<double, double, std::optional<double>>> found;
            for (const auto &[least, largest, left_at] : r.ranges)
              found.emplace_back(least, largest, left_at);
            return found;
          },
          "By limit of the scene: least and largest value, and time (s) when it was left first, or None.")
      .def_ro("last", &TreeRun::last, "(q, v) of the last accepted step.")
      .def_ro("states", &TreeRun::states, "(T, n_q + n_v) q, then v.")
      .def_ro("accelerations", &TreeRun::accelerations, "(T, n_v)")
      .def_ro("multipliers", &TreeRun::lambda, "(T, rows); 0 of equations that depend on others.")
      .def_ro("replayed", &TreeRun::replayed, "(T, numbers) forces of the source of a replay.");
}

void bind_orientation_laws(nb::module_ &m) {
  bind_values(nb::enum_<OrientationKind>(m, "OrientationKind"),
              FFROBOT_VALUES(OrientationKind, rotation_vector, rpy, direction));
  nb::class_<OrientationLaw>(m, "TurningLaw", "A triad A(t); see mbs/core/recursion/mechanism/orientation.h.")
      .def(
          "__init__",
          [](OrientationLaw *law, OrientationKind kind, const std::vector<TimeFunction> &functions,
             const Matrix3d &reference) {
            check_size("functions", functions.size(), 3);
            new (law) OrientationLaw{kind, {functions[0], functions[1], functions[2]}, reference};
          },
          "kind"_a, "functions"_a, "reference"_a)
      .def(
          "sample",
          [](const OrientationLaw &law, const VectorXd &times) {
            RowMajor A(times.size(), 9), omega(times.size(), 3), alpha(times.size(), 3);
            for (Index i = 0; i < times.size(); ++i) {
              const Turning at = law(times[i]);
              A.row(i) = at.A.reshaped<Eigen::RowMajor>().transpose();
              omega.row(i) = at.omega.transpose(), alpha.row(i) = at.alpha.transpose();
            }
            return std::tuple(A, omega, alpha);
          },
          "times"_a, "(A (T, 9), row after row, omega (T, 3), alpha (T, 3)) at times (T,), global axes.");
}

void bind_loads(nb::class_<Scene> scene) {
  scene
      .def(
          "add_load",
          [](Scene &s, const VectorXd &direction, const TimeFunction &magnitude) {
            s.loads.emplace_back(direction, magnitude);
          },
          "direction"_a, "magnitude"_a, "Generalized forces magnitude(t) direction (n_v).")
      .def(
          "add_point_load",
          [](Scene &s, int wrench, int component, const TimeFunction &magnitude, double share) {
            s.point_loads.push_back({wrench, component, magnitude, share});
          },
          "wrench"_a, "component"_a, "magnitude"_a, "share"_a = 1.0,
          "share magnitude(t) along a component of (force, moment), global axes, on a wrench of the model.")
      .def(
          "add_point_force",
          [](Scene &s, int wrench, const StateFunction &function) { s.point_forces.push_back({wrench, function}); },
          "wrench"_a, "function"_a, "A force that depends on the motion of the section of a wrench.")
      .def(
          "add_cut_load",
          [](Scene &s, int joint, const TimeFunction &magnitude, double share) {
            s.cut_loads.push_back({joint, magnitude, share});
          },
          "joint"_a, "magnitude"_a, "share"_a = 1.0,
          "share magnitude(t) along the coordinate of a joint of add_cut_joint, by its number.");
}

void bind_joint_forces(nb::class_<Scene> scene) {
  scene
      .def(
          "add_joint_force",
          [](Scene &s, int q, int v, double stiffness, double rest, double viscous, double coulomb, double speed) {
            s.joint_forces.push_back({q, v, stiffness, rest, {viscous, coulomb, speed}});
          },
          "q"_a, "v"_a, "stiffness"_a, "rest"_a, "viscous"_a, "coulomb"_a, "speed"_a,
          "Spring and friction along the coordinate with these indices in q and v.")
      .def(
          "add_gear",
          [](Scene &s, std::pair<int, int> a, std::pair<int, int> b, double ratio, const std::vector<double> &slopes,
             const std::vector<double> &knots, double damping) {
            if (slopes.size() != knots.size() + 1)
              throw std::invalid_argument("slopes: expected one more than knots");
            s.gears.push_back({{a.first, a.second}, {b.first, b.second}, ratio, {slopes, knots}, damping});
          },
          "a"_a, "b"_a, "ratio"_a, "slopes"_a, "knots"_a, "damping"_a,
          "Piecewise linear spring and damper between two coordinates, indices in q and v each: of the twist a - ratio "
          "b, the next slope from each knot on.")
      .def(
          "add_cut_joint",
          [](Scene &s, int a, int b, bool turns, const Vector3d &axis, double viscous, double coulomb, double speed) {
            s.cut_joints.push_back({a, b, turns, axis, {viscous, coulomb, speed}});
          },
          "a"_a, "b"_a, "turns"_a, "axis"_a, "viscous"_a, "coulomb"_a, "speed"_a,
          "Friction in a joint at which a loop is cut, between two wrenches of the model: of the turn of b about an "
          "axis of a, or of its way along it.");
}

void bind_scene(nb::module_ &m) {
  auto scene = nb::class_<Scene>(m, "TreeScene", "Targets of a mechanism in joint coordinates, and forces on it.");
  bind_loads(scene), bind_joint_forces(scene);
  scene.def(nb::init<>())
      .def(
          "add_target", [](Scene &s, const TimeFunction &law, double sign) { s.targets.push_back({law, sign}); },
          "target"_a, "sign"_a = 1.0, "Of the next constraint equation: sign target(t).")
      .def(
          "watch_posture",
          [](Scene &s, const std::vector<bool> &is_path, double length) {
            s.watch = PostureWatch{{is_path.begin(), is_path.end()}, length};
          },
          "is_path"_a, "length"_a,
          "Watch how well the joints can follow the equations of the path; the run diverges where they cannot.")
      .def(
          "add_limit",
          [](Scene &s, Index v, double lowest, double highest) { s.limits.push_back({v, lowest, highest}); }, "v"_a,
          "lowest"_a, "highest"_a,
          "Watch whether the coordinate with this index in v, a number, stays in a range; the run does not end there.")
      .def_rw("has_loops", &Scene::has_loops,
              "Whether equations close loops, of which some may be redundant; the run ends where these are singular.")
      .def_rw("modal_amplitude_limits", &Scene::modal_amplitude_limits,
              "(bodies) kg m^2: largest p^T p of each that makes sense; empty: any.")
      .def(
          "turn_marker", [](Scene &s, int marker, const OrientationLaw &law) { s.driven.push_back({marker, law}); },
          "marker"_a, "law"_a, "Orientation of a turning marker of the ground.");
}

} // namespace

void bind_tree_motion(nb::module_ &m) {
  m.attr("small_twist") = small_twist; // rad, of gears: mbs/core/recursion/motion/motion_norm.h
  bind_checkpoint(m);
  bind_run(m);
  bind_orientation_laws(m);
  bind_scene(m);
  bind_motion<Planar>(m);
  bind_motion<Spatial>(m);
}
