// Motions of mechanisms in joint coordinates: mbs/core/recursion/motion.h.
#include "core/recursion/motion.h"
#include "core/integrate/integrate.h"

#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include "bindings/recursion/recursion.h"

namespace nb = nanobind;
using namespace nb::literals;
using namespace ffrobot;
using namespace ffrobot::recursion;
using Eigen::Index;
using Eigen::VectorXd;
using RowMajorMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

namespace {

template <class Space> void check_scene(const Model<Space> &model, const Scene &scene) {
  check_size("targets", static_cast<Index>(scene.targets.size()), model.rows());
  for (const Load &load : scene.loads)
    check_size("direction of a load", load.direction.size(), model.mechanism.n_v);
}

using Report = std::tuple<IntegrationStatus, unsigned long, unsigned long>; // status, steps, evaluations

// (report, states (T, n_q + n_v), accelerations (T, n_v), multipliers (T, rows)) at `times`
template <class Space>
std::tuple<Report, RowMajorMatrix, RowMajorMatrix, RowMajorMatrix>
motion_of(const Model<Space> &model, const Scene &scene, const std::vector<double> &times, const VectorXd &q,
          const VectorXd &v, const IntegrationControls &controls) {
  model.check_state(q, v);
  check_scene(model, scene);
  RecursiveMotion<Space> motion(model.mechanism, scene, q.data(), v.data());
  const auto count = static_cast<Index>(times.size());
  const Index n_q = q.size(), n_v = v.size();
  RowMajorMatrix states(count, n_q + n_v), accelerations_(count, n_v), lambda(count, model.rows());
  VectorXd y(n_q + n_v);
  y << q, v;
  const auto report = integrate(
      motion, times, y, controls,
      [&](std::size_t i, double, const double *at) {
        states.row(static_cast<Index>(i)) = Eigen::Map<const Eigen::RowVectorXd>(at, n_q + n_v);
      },
      [](double) { return true; }, nullptr);
  RecursiveMotion<Space> reader(model.mechanism, scene, q.data(), v.data());
  const auto reached = static_cast<Index>(report.outputs);
  for (Index i = 0; i < reached; ++i) {
    const double *at = states.row(i).data();
    reader.evaluate(times[static_cast<std::size_t>(i)], at, at + n_q, accelerations_.row(i).data());
    lambda.row(i) = Eigen::Map<const Eigen::RowVectorXd>(reader.workspace().lambda.data(), model.rows());
  }
  return {Report(report.status, report.steps, report.evaluations), states.topRows(reached),
          accelerations_.topRows(reached), lambda.topRows(reached)};
}

// (q, v, what is left) on the rows at time t
template <class Space>
std::tuple<VectorXd, VectorXd, double> projected(const Model<Space> &model, const Scene &scene, double t, VectorXd q,
                                                 VectorXd v) {
  model.check_state(q, v);
  check_scene(model, scene);
  RecursiveMotion<Space> motion(model.mechanism, scene, q.data(), v.data());
  VectorXd a(v.size());
  motion.evaluate(t, q.data(), v.data(), a.data());
  const double left = motion.project(t, q.data(), v.data());
  return {q, v, left};
}

template <class Space> void bind_motion(nb::module_ &m) {
  m.def("tree_motion", &motion_of<Space>, "model"_a, "scene"_a, "times"_a, "q"_a, "v"_a, "controls"_a,
        "((status, steps, evaluations), states (T, n_q + n_v), accelerations (T, n_v), multipliers (T, rows)), "
        "adaptive.");
  m.def("tree_projected", &projected<Space>, "model"_a, "scene"_a, "t"_a, "q"_a, "v"_a,
        "(q, v, largest residual left) on the rows at time t, by Newton steps in the mass metric.");
}

} // namespace

void bind_tree_motion(nb::module_ &m) {
  nb::class_<Scene>(m, "TreeScene", "What a mechanism in joint coordinates follows and what acts on it.")
      .def(nb::init<>())
      .def(
          "add_target", [](Scene &s, const TimeFunction &target) { s.targets.push_back(target); }, "target"_a,
          "Of the next row.")
      .def(
          "add_load",
          [](Scene &s, const VectorXd &direction, const TimeFunction &magnitude) {
            s.loads.push_back({direction, magnitude});
          },
          "direction"_a, "magnitude"_a, "Generalized forces magnitude(t) direction (n_v).")
      .def(
          "add_joint_force",
          [](Scene &s, int q, int v, double stiffness, double rest, double viscous, double coulomb, double speed) {
            s.joint_forces.push_back({q, v, stiffness, rest, {viscous, coulomb, speed}});
          },
          "q"_a, "v"_a, "stiffness"_a, "rest"_a, "viscous"_a, "coulomb"_a, "speed"_a,
          "Spring and friction along the coordinate with these indices in q and v.");
  bind_motion<Planar>(m);
  bind_motion<Spatial>(m);
}
