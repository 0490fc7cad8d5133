// Motions under held inputs, as FMUs run them: mbs/core/forward/forward_motion.h.
#include "core/forward/forward_motion.h"

#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "bindings/recursion/recursion.h"

void bind_forward_motion(nb::module_ &m) {
  nb::class_<LinearOutput>(m, "LinearOutput", "An output that is linear in the state (q, v).")
      .def(nb::init<std::vector<int>, std::vector<double>>(), "entries"_a, "weights"_a);
  nb::class_<PlaceOutput>(m, "PlaceOutput", "Three outputs: position of a section of a body, m, global axes.")
      .def(nb::init<int, Vector3d, MatrixXd, std::vector<MatrixXd>>(), "body"_a, "position"_a, "Phi"_a, "K"_a);
  nb::class_<ForwardModel>(m, "ForwardModel",
                           "Data of a motion under held inputs, for FMUs; see mbs/core/forward/forward_motion.h.")
      .def(
          "__init__",
          [](ForwardModel *model, const std::vector<BodyModel<SpatialData>> &bodies,
             const std::vector<SpatialMarker> &ground, const std::vector<ConstraintModel> &rows,
             const std::vector<MarkerAt> &wrenches, const VectorXd &gravity, const Scene &scene) {
            new (model) ForwardModel();
            model->bodies = bodies, model->ground = ground, model->rows = rows, model->gravity = gravity;
            model->wrenches = wrenches, model->cut_joints = scene.cut_joints;
            model->joint_forces = scene.joint_forces, model->gears = scene.gears;
          },
          "bodies"_a, "ground"_a, "rows"_a, "wrenches"_a, "gravity"_a, "scene"_a,
          "Of the scene, only joint forces, gears and cut joints.")
      .def_rw("guid", &ForwardModel::guid)
      .def_rw("inputs", &ForwardModel::inputs)
      .def_rw("linear", &ForwardModel::linear)
      .def_rw("places", &ForwardModel::places)
      .def_rw("q", &ForwardModel::q)
      .def_rw("v", &ForwardModel::v)
      .def_rw("method", &ForwardModel::method)
      .def_rw("spectral_radius", &ForwardModel::spectral_radius)
      .def_rw("tolerance", &ForwardModel::tolerance)
      .def_rw("duration", &ForwardModel::duration)
      .def(
          "to_bytes",
          [](const ForwardModel &model) {
            const std::string bytes = bytes_of(model);
            return nb::bytes(bytes.data(), bytes.size());
          },
          "Bytes that FMUs read.");
}
