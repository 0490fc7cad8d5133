// Motions of mechanisms in joint coordinates: mbs/core/recursion/motion.h.
#include "core/recursion/motion.h"
#include "core/integrate/integrate.h"
#include "core/recursion/observe.h"

#include <nanobind/stl/function.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include "bindings/recursion/recursion.h"

namespace nb = nanobind;
using namespace nb::literals;
using namespace ffrobot;
using namespace ffrobot::recursion;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using RowMajorMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

namespace {

template <class Space> void check_scene(const Model<Space> &model, const Scene &scene) {
  check_size("targets", static_cast<Index>(scene.targets.size()), model.rows());
  const auto check_index = [](const char *name, int got, std::size_t count) {
    if (got < 0 || got >= static_cast<int>(count))
      throw nb::value_error(
          (std::string(name) + ": expected 0 to " + std::to_string(count) + " - 1, got " + std::to_string(got))
              .c_str());
  };
  const auto n_q = static_cast<std::size_t>(model.mechanism.n_q), n_v = static_cast<std::size_t>(model.mechanism.n_v);
  for (const Load &load : scene.loads)
    for (const auto &[i, share] : load.along)
      check_index("coordinate of a load", i, n_v);
  for (const PointLoad &load : scene.point_loads) {
    check_index("wrench of a load", load.wrench, model.mechanism.wrenches.size());
    check_index("component of a load", load.component, Space::dim);
  }
  for (const JointForce &force : scene.joint_forces)
    check_index("q of a joint's force", force.q, n_q), check_index("v of a joint's force", force.v, n_v);
  for (const FrameMotor &motor : scene.frame_motors) {
    const auto last = static_cast<int>(motor.Phi_r.cols()) - 1;
    check_index("q of a motor on frames", motor.q, n_q), check_index("v of a motor on frames", motor.v, n_v);
    check_index("q of a motor on frames", motor.q + last, n_q);
    check_index("v of a motor on frames", motor.v + last, n_v);
  }
  for (const GearSpring &gear : scene.gears)
    for (const GearSpring::Side &side : {gear.a, gear.b})
      check_index("q of a gear", side.q, n_q), check_index("v of a gear", side.v, n_v);
  if (scene.watch)
    check_size("is_path", static_cast<Index>(scene.watch->is_path.size()), model.rows());
  for (const DrivenMarker &driven : scene.driven)
    check_index("marker of the ground", driven.marker, model.mechanism.ground.size());
}

// What a motion is at outputs, as far as it got.
struct TreeRun {
  IntegrationReport report;
  VectorXd last;                                // (q, v) of the last accepted step
  RowMajorMatrix states, accelerations, lambda; // (T, n_q + n_v), (T, n_v), (T, rows)
  RowMajorMatrix frames;                        // (T, 6 bodies) of each body: R_ddot of its origin, alpha
  RowMajorMatrix energy;                        // (T, 3) kinetic, strain, gravitational
  double least_ratio = 1, singular_at = 0;      // of the scene's watch
  VectorXd singular_posture;
};

// All that is read off the states of a run at the first `reached` of `times`
template <class Space>
void evaluate_outputs(RecursiveMotion<Space> &motion, const Mechanism<Space> &mechanism,
                      const std::vector<double> &times, TreeRun &run) {
  const Index reached = run.states.rows(), n_q = mechanism.n_q;
  run.accelerations.resize(reached, mechanism.n_v), run.lambda.resize(reached, run.lambda.cols());
  run.frames.resize(reached, 6 * static_cast<Index>(mechanism.nodes.size())), run.energy.resize(reached, 3);
  for (Index i = 0; i < reached; ++i) {
    const double *q = run.states.row(i).data(), *v = q + n_q;
    motion.evaluate(times[static_cast<std::size_t>(i)], q, v, run.accelerations.row(i).data());
    run.lambda.row(i) = Eigen::Map<const Eigen::RowVectorXd>(motion.workspace().lambda.data(), run.lambda.cols());
    Index column = 0;
    for (const FrameMotion &frame : frame_motions(mechanism, q, v, motion.workspace())) {
      run.frames.row(i).segment<3>(column) = frame.a_origin.transpose();
      run.frames.row(i).segment<3>(column + 3) = frame.alpha.transpose();
      column += 6;
    }
    const Totals sum = totals(mechanism, q, v, motion.workspace());
    run.energy.row(i) << sum.kinetic, sum.strain, sum.gravitational;
  }
}

template <class Space>
TreeRun motion_of(const Model<Space> &model, const Scene &scene, const std::vector<double> &times, const VectorXd &q,
                  const VectorXd &v, const IntegrationControls &controls, const std::function<bool(double)> &carry_on) {
  model.check_state(q, v);
  check_scene(model, scene);
  const nb::gil_scoped_release unlocked;
  RecursiveMotion<Space> motion(model.mechanism, scene, times.front(), q.data(), v.data());
  TreeRun run;
  run.states.resize(static_cast<Index>(times.size()), q.size() + v.size()), run.lambda.resize(0, model.rows());
  run.last.resize(q.size() + v.size());
  run.last << q, v;
  run.report = integrate(
      motion, times, run.last, controls,
      [&](std::size_t i, double, const double *at) {
        run.states.row(static_cast<Index>(i)) = Eigen::Map<const Eigen::RowVectorXd>(at, run.states.cols());
      },
      [&](double t) {
        const nb::gil_scoped_acquire locked;
        return carry_on(t);
      },
      nullptr);
  run.least_ratio = motion.least_ratio(), run.singular_at = motion.singular_at();
  run.singular_posture = motion.singular_posture();
  run.states.conservativeResize(static_cast<Index>(run.report.outputs), Eigen::NoChange);
  RecursiveMotion<Space> reader(model.mechanism, scene, times.front(), q.data(), v.data());
  evaluate_outputs(reader, model.mechanism, times, run);
  return run;
}

// The same of states (T, n_q + n_v) that are known
template <class Space>
TreeRun outputs_of(const Model<Space> &model, const Scene &scene, const std::vector<double> &times,
                   const RowMajorMatrix &states) {
  check_scene(model, scene);
  check_size("states", states.cols(), model.mechanism.n_q + model.mechanism.n_v);
  check_size("times", static_cast<Index>(times.size()), states.rows());
  TreeRun run;
  run.states = states, run.lambda.resize(0, model.rows());
  if (times.empty())
    return run;
  const double *first = run.states.row(0).data();
  RecursiveMotion<Space> reader(model.mechanism, scene, times.front(), first, first + model.mechanism.n_q);
  evaluate_outputs(reader, model.mechanism, times, run);
  return run;
}

// (q, v, what is left) on the rows at time t
template <class Space>
std::tuple<VectorXd, VectorXd, double> projected(const Model<Space> &model, const Scene &scene, double t, VectorXd q,
                                                 VectorXd v) {
  model.check_state(q, v);
  check_scene(model, scene);
  RecursiveMotion<Space> motion(model.mechanism, scene, t, q.data(), v.data());
  VectorXd a(v.size());
  motion.evaluate(t, q.data(), v.data(), a.data());
  const double left = motion.project(t, q.data(), v.data());
  return {q, v, left};
}

template <class Space> void bind_motion(nb::module_ &m) {
  m.def(
      "tree_motion", &motion_of<Space>, "model"_a, "scene"_a, "times"_a, "q"_a, "v"_a, "controls"_a, "carry_on"_a,
      "Integrates the motion from (q, v) at the first of `times` and reports it at all of them; carry_on(t), which is\n"
      "called now and then, ends it where it gives False.");
  m.def("tree_outputs", &outputs_of<Space>, "model"_a, "scene"_a, "times"_a, "states"_a,
        "What a run reports of states (T, n_q + n_v) that are known.");
  m.def("tree_projected", &projected<Space>, "model"_a, "scene"_a, "t"_a, "q"_a, "v"_a,
        "(q, v, largest residual left) on the rows at time t, by Newton steps in the mass metric.");
}

void bind_run_and_laws(nb::module_ &m) {
  nb::class_<TreeRun>(m, "TreeRun", "A motion in joint coordinates at outputs, as far as it got.")
      .def_prop_ro("status", [](const TreeRun &r) { return r.report.status; })
      .def_prop_ro("steps", [](const TreeRun &r) { return r.report.steps; })
      .def_prop_ro("rejected", [](const TreeRun &r) { return r.report.rejected; })
      .def_prop_ro("evaluations", [](const TreeRun &r) { return r.report.evaluations; })
      .def_prop_ro("time_reached", [](const TreeRun &r) { return r.report.time; })
      .def_ro("least_ratio", &TreeRun::least_ratio,
              "Of the scene's watch: 1 without; see mbs/core/recursion/posture.h.")
      .def_ro("singular_at", &TreeRun::singular_at, "When that was, s.")
      .def_ro("singular_posture", &TreeRun::singular_posture, "(n_q) q there; empty without a watch.")
      .def_ro("last", &TreeRun::last, "(q, v) of the last accepted step.")
      .def_ro("states", &TreeRun::states, "(T, n_q + n_v) q, then v.")
      .def_ro("accelerations", &TreeRun::accelerations, "(T, n_v)")
      .def_ro("multipliers", &TreeRun::lambda, "(T, rows); 0 of rows that depend on others.")
      .def_ro("frames", &TreeRun::frames, "(T, 6 bodies): of each body R_ddot of its origin and alpha, global axes.")
      .def_ro("energy", &TreeRun::energy, "(T, 3) kinetic, strain, gravitational, J.");
  nb::enum_<OrientationKind>(m, "OrientationKind")
      .value("rotation_vector", OrientationKind::rotation_vector)
      .value("rpy", OrientationKind::rpy)
      .value("direction", OrientationKind::direction);
  nb::class_<OrientationLaw>(m, "TurningLaw", "A triad A(t); see mbs/core/recursion/orientation.h.")
      .def(
          "__init__",
          [](OrientationLaw *law, OrientationKind kind, const std::vector<TimeFunction> &functions,
             const Eigen::Matrix3d &reference) {
            check_size("functions", static_cast<Index>(functions.size()), 3);
            new (law) OrientationLaw{kind, {functions[0], functions[1], functions[2]}, reference};
          },
          "kind"_a, "functions"_a, "reference"_a)
      .def(
          "__call__",
          [](const OrientationLaw &law, double t) {
            const Turning at = law(t);
            return std::tuple(at.A, at.omega, at.alpha);
          },
          "t"_a, "(A (3, 3), omega (3,), alpha (3,)) at time t, global axes.");
}

} // namespace

void bind_tree_motion(nb::module_ &m) {
  bind_run_and_laws(m);
  nb::class_<Scene>(m, "TreeScene", "What a mechanism in joint coordinates follows and what acts on it.")
      .def(nb::init<>())
      .def(
          "add_target", [](Scene &s, const TimeFunction &law, double sign) { s.targets.push_back({law, sign}); },
          "target"_a, "sign"_a = 1.0, "Of the next row: sign target(t).")
      .def(
          "add_load",
          [](Scene &s, const VectorXd &direction, const TimeFunction &magnitude) {
            s.loads.emplace_back(direction, magnitude);
          },
          "direction"_a, "magnitude"_a, "Generalized forces magnitude(t) direction (n_v).")
      .def(
          "add_point_load",
          [](Scene &s, int wrench, int component, const TimeFunction &magnitude) {
            s.point_loads.push_back({wrench, component, magnitude});
          },
          "wrench"_a, "component"_a, "magnitude"_a,
          "Along a component of (force, moment), global axes, on a wrench of the model.")
      .def(
          "add_joint_force",
          [](Scene &s, int q, int v, double stiffness, double rest, double viscous, double coulomb, double speed) {
            s.joint_forces.push_back({q, v, stiffness, rest, {viscous, coulomb, speed}});
          },
          "q"_a, "v"_a, "stiffness"_a, "rest"_a, "viscous"_a, "coulomb"_a, "speed"_a,
          "Spring and friction along the coordinate with these indices in q and v.")
      .def(
          "add_frame_motor",
          [](Scene &s, int q, int v, const Eigen::MatrixXd &rotation, const Eigen::Vector3d &axis,
             const TimeFunction &magnitude) {
            check_size("rotation", rotation.rows(), 3);
            s.frame_motors.push_back({q, v, rotation, axis, magnitude});
          },
          "q"_a, "v"_a, "rotation"_a, "axis"_a, "magnitude"_a,
          "What a motor that turns the frame of a body takes back on its modes: see core/recursion/frame_motor.h.")
      .def(
          "add_gear",
          [](Scene &s, std::pair<int, int> a, std::pair<int, int> b, double ratio, double stiffness, double damping) {
            s.gears.push_back({{a.first, a.second}, {b.first, b.second}, ratio, stiffness, damping});
          },
          "a"_a, "b"_a, "ratio"_a, "stiffness"_a, "damping"_a,
          "Spring and damper between two coordinates, indices in q and v each: of the twist a - ratio b.")
      .def(
          "watch_posture",
          [](Scene &s, const std::vector<bool> &is_path, double length) {
            s.watch = PostureWatch{{is_path.begin(), is_path.end()}, length};
          },
          "is_path"_a, "length"_a,
          "Watch how well the joints can follow the rows of the path; the run diverges where they cannot at all.")
      .def(
          "turn_marker", [](Scene &s, int marker, const OrientationLaw &law) { s.driven.push_back({marker, law}); },
          "marker"_a, "law"_a, "How a marker of the ground turns, which the model says it does.");
  bind_motion<Planar>(m);
  bind_motion<Spatial>(m);
}
