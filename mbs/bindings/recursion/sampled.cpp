// Motions in joint coordinates under a sampled controller: core/integrate/sampled_loop.h.
#include "core/integrate/sampled_loop.h"

#include <nanobind/stl/function.h>
#include <nanobind/stl/vector.h>

#include "bindings/recursion/tree_run.h"

namespace {

using Controller = std::function<VectorXd(std::size_t, double, const VectorXd &)>;

template <class Space>
TreeRun sampled_motion_of(const Model<Space> &model, const Scene &scene, const std::vector<double> &times,
                          const VectorXd &q, const VectorXd &v, const IntegrationControls &controls,
                          const std::function<bool(double)> &carry_on, ZeroOrderHold held,
                          const VectorXd &first_command, const std::vector<double> &samples, double delay,
                          const Controller &controller, Samples *between) {
  model.check_state(q, v);
  check_scene(model, scene);
  check_hold(model, held);
  check_size("first_command", first_command.size(), held.direction().cols());
  const nb::gil_scoped_release unlocked;
  held.hold(first_command);
  RecursiveMotion<Space> motion(model.mechanism, scene, times.front(), q.data(), v.data(), &held);
  RecursiveMotion<Space> reader(model.mechanism, scene, times.front(), q.data(), v.data(), &held);
  const Index size = q.size() + v.size();
  VectorXd read(size + v.size()); // (q, v, a)
  const auto command = [&, call = locked(controller)](std::size_t k, double t, const double *y) {
    read.head(size) = Map<const VectorXd>(y, size);
    reader.evaluate(t, y, y + q.size(), read.data() + size);
    return call(k, t, read);
  };
  const auto hold = [&](const VectorXd &u) {
    check_size("commands", u.size(), held.direction().cols());
    held.hold(u);
  };
  const Sampling sampling{samples, delay, command, hold};
  const Breaks breaks = sampled_breaks(sampling, times.back());
  return integrated(model, scene, motion, reader, times, q, v, controls, carry_on,
                    {.breaks = &breaks, .samples = between});
}

template <class Space>
TreeRun outputs_under_hold(const Model<Space> &model, const Scene &scene, const std::vector<double> &times,
                           const Rows &states, ZeroOrderHold held, const Rows &commands) {
  check_hold(model, held);
  check_size("commands", commands.rows(), states.rows());
  check_size("inputs", commands.cols(), held.direction().cols());
  return outputs_at(model, scene, times, states, &held, nullptr,
                    [&](Index i) { held.hold(commands.row(i).transpose()); });
}

template <class Space> void bind_sampled_motion(nb::module_ &m) {
  m.def("tree_sampled", &sampled_motion_of<Space>, nb::kw_only(), "model"_a, "scene"_a, "times"_a, "q"_a, "v"_a,
        "controls"_a, "carry_on"_a, "held"_a, "first_command"_a, "samples"_a, "delay"_a, "controller"_a,
        "between"_a = nb::none(),
        "As tree_motion, under commands of `controller`(k, t, (q, v, a)) at samples, which act through `held`.");
  m.def("tree_outputs_under", &outputs_under_hold<Space>, "model"_a, "scene"_a, "times"_a, "states"_a, "held"_a,
        "commands"_a, "As tree_outputs, under commands (T, inputs).");
}

} // namespace

void bind_tree_sampled(nb::module_ &m) {
  nb::class_<ZeroOrderHold>(m, "ZeroOrderHold",
                            "Forces of a unit of each command: see mbs/core/recursion/motion/zero_order_hold.h.")
      .def(nb::init<MatrixXd>(), "direction"_a, "Generalized forces (n_v, inputs).")
      .def(
          "add_frame_motor",
          [](ZeroOrderHold &held, Index input, int q, int v, const MatrixXd &rotation, const Vector3d &axis) {
            check_size("rotation", rotation.rows(), 3);
            held.add_frame_motor(input, {q, v, rotation, axis});
          },
          "input"_a, "q"_a, "v"_a, "rotation"_a, "axis"_a,
          "Modal forces of a motor that turns the frame of a body: see FrameShare there.");
  bind_sampled_motion<Planar>(m);
  bind_sampled_motion<Spatial>(m);
}
