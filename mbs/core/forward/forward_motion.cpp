#include "core/forward/forward_motion.h"

#include "core/archive.h"

namespace ffrobot {

namespace {

using namespace recursion;

const std::string head = "ffrobot held motion 5\n"; // another number wherever fields change

void check(bool holds, const char *expected) {
  if (!holds)
    throw std::invalid_argument(std::string("expected ") + expected);
}

} // namespace

std::string bytes_of(const ForwardModel &model) { return head + to_bytes(model); }

ForwardModel forward_model_of(const std::string &bytes) {
  if (bytes.compare(0, head.size(), head) != 0)
    throw std::runtime_error("expected a model of this version of ffrobot, found another file");
  return of_bytes<ForwardModel>(bytes.substr(head.size()));
}

ForwardMotion::ForwardMotion(ForwardModel model)
    : model_(std::move(model)), mechanism_(model_.bodies, model_.ground, model_.rows, model_.wrenches, model_.gravity),
      scene_(scene_of(model_)), y_(model_.q.size() + model_.v.size()), inputs_(model_.inputs.size(), 0.0),
      outputs_(output_count(), 0.0) {
  y_ << model_.q, model_.v;
  motion_.emplace(mechanism_, scene_, 0, model_.q.data(), model_.v.data());
  motion_->plan(0, model_.duration);
}

// Checked before anything reads the state.
Scene ForwardMotion::scene_of(const ForwardModel &model) {
  Index n_q = 0, n_v = 0;
  for (const auto &body : model.bodies) {
    const JointShape shape = Spatial::shape(body.joint);
    n_q += shape.q_count() + body.data.modes(), n_v += shape.freedoms.count + body.data.modes();
  }
  check(model.q.size() == n_q && model.v.size() == n_v, "a state of the bodies' joints and modes");
  check(model.duration > 0, "a duration above 0");
  Scene scene;
  scene.has_loops = !model.rows.empty();
  scene.targets.assign(model.rows.size(), {TimeFunction(Constant(0)), 1});
  for (const VectorXd &direction : model.inputs) {
    check(direction.size() == n_v, "inputs along v");
    scene.loads.emplace_back(direction, Constant(0));
  }
  for (const LinearOutput &output : model.linear) {
    check(output.entries.size() == output.weights.size(), "a weight for each entry of an output");
    for (const int entry : output.entries)
      check(entry >= 0 && entry < n_q + n_v, "outputs of the state");
  }
  for (const PlaceOutput &output : model.places) {
    check(output.body >= 0 && output.body < static_cast<int>(model.bodies.size()), "places on bodies");
    check(output.K.empty() || output.K.size() == 3, "geometric stiffness along three axes");
  }
  scene.joint_forces = model.joint_forces;
  scene.gears = model.gears;
  scene.cut_joints = model.cut_joints;
  for (const CutJoint &cut : model.cut_joints)
    for (const int wrench : {cut.a, cut.b})
      check(wrench >= 0 && wrench < static_cast<int>(model.wrenches.size()), "cut joints between wrenches");
  return scene;
}

IntegrationStatus ForwardMotion::step(double t, double h) {
  for (std::size_t i = 0; i < inputs_.size(); ++i)
    scene_.loads[i].magnitude = Constant(inputs_[i]);
  IntegrationControls controls;
  controls.tolerance = model_.tolerance * std::min(1.0, h / model_.duration);
  controls.methods = {{{model_.method, model_.spectral_radius}, 1, 0}};
  if (history_.has_begun()) // step sizes go on; the state is the first output
    history_.time = t, history_.outputs = 1;
  outputs_are_old_ = true;
  const IntegrationReport report = integrate(
      *motion_, {t, t + h}, y_, controls, [](std::size_t, double, const double *) {}, [](double) { return true; },
      {.checkpoint = &history_});
  return report.status;
}

// Begun anew, since implicit methods keep matrices of the steps after it.
void ForwardMotion::bring_back(const ForwardState &state) {
  motion_.emplace(mechanism_, scene_, 0, model_.q.data(), model_.v.data());
  motion_->plan(0, model_.duration);
  motion_->go_on(state.motion);
  y_ = state.y, history_ = state.steps, inputs_ = state.inputs;
  outputs_are_old_ = true;
}

const std::vector<double> &ForwardMotion::outputs() {
  if (!outputs_are_old_)
    return outputs_;
  outputs_are_old_ = false;
  std::size_t i = 0;
  for (const LinearOutput &output : model_.linear) {
    double sum = 0;
    for (std::size_t k = 0; k < output.entries.size(); ++k)
      sum += output.weights[k] * y_[output.entries[k]];
    outputs_[i++] = sum;
  }
  if (model_.places.empty())
    return outputs_;
  const double *q = y_.data(), *v = q + mechanism_.n_q;
  VectorXd a(mechanism_.n_v);
  motion_->evaluate(0, q, v, a.data());
  place_all(q, v, nullptr, motion_->workspace());
  const auto frames = frame_motions(motion_->workspace());
  for (const PlaceOutput &output : model_.places) {
    const std::size_t number = output.body;
    const auto &node = mechanism_.nodes[number];
    Vector3d x = output.position;
    if (node.n()) {
      const auto p = y_.segment(node.p_q(), node.n());
      x += output.Phi * p;
      for (std::size_t l = 0; l < output.K.size(); ++l)
        x[l] -= 0.5 * p.dot(output.K[l] * p);
    }
    x = frames[number].r + frames[number].R * (node.origin + node.axes * x);
    std::copy_n(x.data(), 3, outputs_.data() + i);
    i += 3;
  }
  return outputs_;
}

} // namespace ffrobot
