// Forces that inverse analyses found, and runs under them: mbs/core/analysis/found_forces.h and replay.h.
#include "core/analysis/found_forces.h"

#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include "bindings/recursion/tree_run.h"

namespace {

template <class Space> using Reader = std::shared_ptr<ForceReader<Space>>;
using Source = std::shared_ptr<ForceSource>;

template <class Space>
Reader<Space> actuators_of(const DrivenMechanism<Space> &driven, const VectorXd &limit,
                           const std::vector<std::tuple<int, MatrixXd, Allocation>> &patches) {
  check_size("limit", limit.size(), driven.motors.size());
  std::vector<LinkPatches> links;
  for (const auto &[first, reached, allocation] : patches) {
    check_index("first mode of patches", first, driven.mechanism.n_v);
    check_index("last mode of patches", first + reached.cols() - 1, driven.mechanism.n_v);
    check_size("reached", reached.rows(), allocation.Phi().rows());
    links.push_back({first, reached, allocation});
  }
  return std::make_shared<ActuatorReader<Space>>(driven, limit, std::move(links));
}

template <class Space>
Reader<Space> paths_of(const DrivenMechanism<Space> &driven, const Matrix3d &axes,
                       const std::vector<std::tuple<int, int, double>> &parts, Index count) {
  std::vector<typename PathReader<Space>::Part> found;
  for (const auto &[row, column, sign] : parts) {
    check_index("constraint equation", row, driven.mechanism.constraints.size());
    const bool is_coordinate = driven.mechanism.constraints[row].model.kind == ConstraintKind::coordinate;
    check_index("column of a path", column, is_coordinate ? count : count - 5);
    found.push_back({row, column, sign});
  }
  return std::make_shared<PathReader<Space>>(driven.mechanism, axes, std::move(found), count);
}

using OfBody = std::tuple<int, Matrix3d, Vector3d, Eigen::Matrix3Xd, Eigen::Matrix3Xd, MatrixXd, VectorXd>;

Reader<Spatial> points_of(const DrivenMechanism<Spatial> &driven, const std::vector<OfBody> &bodies) {
  std::vector<PointComponents> found;
  for (const auto &[node, axes, origin, direction, position, Phi, scale] : bodies) {
    check_index("body with points", node, driven.mechanism.nodes.size());
    const Index n = driven.mechanism.nodes[node].n();
    check_size("position", position.cols(), direction.cols());
    check_size("rows of Phi", Phi.rows(), 3 * direction.cols());
    check_size("modes of Phi", Phi.cols(), n);
    check_size("scale", scale.size(), 6 + n);
    found.push_back({node, axes, origin, direction, position, Phi, scale});
  }
  return std::make_shared<PointReader>(driven, std::move(found));
}

template <class Space>
Source recorded(const DrivenMechanism<Space> &driven, const Recording &recording, Reader<Space> reader) {
  const std::size_t size = driven.mechanism.n_q + driven.mechanism.n_v;
  if (recording.times.size() < 2 || recording.states.size() != size * recording.times.size() ||
      recording.methods.empty())
    throw nb::value_error("recording: expected one of this mechanism, with a step");
  return std::make_shared<RecordedForces<Space>>(driven.mechanism, driven.scene, recording, std::move(reader));
}

template <class Space>
Source prescribed(PrescribedMotion<Space> &motion, const std::vector<ModalShape> &shape, const VectorXd &q,
                  Reader<Space> reader) {
  Index modes = 0;
  for (const ModalShape &of_body : shape)
    modes += of_body.size();
  check_size("shape", modes, motion.modes());
  check_size("q", q.size(), motion.driven().mechanism.n_q);
  return std::make_shared<PrescribedForces<Space>>(motion, shape, q, std::move(reader));
}

template <class Space> void bind_found_forces(nb::module_ &m, const std::string &space) {
  nb::class_<ForceReader<Space>>(m, (space + "ForceReader").c_str(), "Reads forces off states of a motion.");
  m.def("actuator_reader", &actuators_of<Space>, "driven"_a, "limit"_a, "patches"_a, nb::keep_alive<0, 1>(),
        "Forces of motors within limits, then voltages of the patches of links: (first mode in v, modal forces that "
        "they\nreach by those on the modes, allocation).");
  m.def("path_reader", &paths_of<Space>, "driven"_a, "axes"_a, "parts"_a, "count"_a, nb::keep_alive<0, 1>(),
        "Forces of constraint equations (number, column, sign): see mbs/core/analysis/found_forces.h.");
  m.def("recorded_forces", &recorded<Space>, "driven"_a, "recording"_a, "reader"_a, nb::keep_alive<0, 1>(),
        nb::keep_alive<0, 2>(), nb::keep_alive<0, 3>(), "Forces that are read off a recorded run.");
  m.def("prescribed_forces", &prescribed<Space>, "motion"_a, "shape"_a, "q"_a, "reader"_a, nb::keep_alive<0, 1>(),
        nb::keep_alive<0, 4>(), "Forces of a prescribed motion; shape: p(t) by body; q (n_q): near the first posture.");
}

RowMajor sampled(ForceSource &source, const std::vector<double> &times) {
  const nb::gil_scoped_release unlocked;
  RowMajor found(times.size(), source.values().size());
  for (std::size_t i = 0; i < times.size(); ++i) {
    source.evaluate(times[i]);
    found.row(i) = source.values().transpose();
  }
  return found;
}

void make_replay(Replay *made, Source source, const ZeroOrderHold &along,
                 const std::vector<std::tuple<Index, Index, double>> &at_points) {
  check_size("inputs", along.direction().cols(), source->values().size());
  std::vector<Replay::AtPoint> found;
  for (const auto &[number, entry, share] : at_points) {
    check_index("number of a source", number, source->values().size());
    found.push_back({number, entry, share});
  }
  new (made) Replay(std::move(source), along, std::move(found));
}

} // namespace

void bind_replay(nb::module_ &m) {
  nb::class_<ForceSource>(m, "ForceSource", "Forces and voltages that an earlier analysis found, at any time of it.")
      .def("sample", &sampled, "times"_a, "(T, numbers) at times (T,).");
  nb::class_<ForcesOfTime, ForceSource>(m, "ForcesOfTime", "Forces that are functions of time.")
      .def(nb::init<std::vector<TimeFunction>>(), "functions"_a);
  nb::class_<ForcesOfBoth, ForceSource>(m, "ForcesOfBoth", "The forces of one source, then those of another.")
      .def(nb::init<Source, Source>(), "first"_a, "second"_a);
  nb::class_<Replay>(m, "Replay", "Forces of a source that act in a run.")
      .def("__init__", &make_replay, "source"_a, "along"_a, "at_points"_a,
           "along: generalized forces of a unit of each; at_points: (number, entry in wrenches, share).");
  bind_found_forces<Planar>(m, "Planar");
  bind_found_forces<Spatial>(m, "Spatial");
  m.def("point_reader", &points_of, "driven"_a, "bodies"_a, nb::keep_alive<0, 1>(),
        "Forces of paths at points of bodies (number, axes and origin of its data in the frame, directions and "
        "positions (3, c), Phi (3 c, n), scale (6 + n)): "
        "(3)\nof each component, global axes.");
}
