// The motion of a robot in space under inputs that are held over steps, without Python: what an FMU runs.
#pragma once

#include "core/integrate/integrate.h"
#include "core/recursion/inverse/observe.h"

namespace ffrobot {

// An output that is linear in the state: weights on entries of y = (q, v).
struct LinearOutput {
  std::vector<int> entries;
  std::vector<double> weights;

  FFROBOT_FIELDS(entries, weights);
};

// Three outputs, the place of a section in global axes (m): r + A (position + Phi p - 1/2 p^T K p).
struct PlaceOutput {
  int body = 0;
  Vector3d position = Vector3d::Zero(); // m, body axes
  MatrixXd Phi;                         // (3, n)
  std::vector<MatrixXd> K;              // three (n, n) of geometric stiffening; empty without

  FFROBOT_FIELDS(body, position, Phi, K);
};

// Everything that such a motion needs; rows close loops.
struct ForwardModel {
  std::string guid; // of the export that it belongs to
  std::vector<recursion::BodyModel<recursion::SpatialData>> bodies;
  std::vector<recursion::SpatialMarker> ground;
  std::vector<recursion::ConstraintModel> rows;
  VectorXd gravity; // (3) m/s^2
  std::vector<recursion::JointForce> joint_forces;
  std::vector<recursion::GearSpring> gears;
  std::vector<recursion::MarkerAt> wrenches; // those of cut joints
  std::vector<recursion::CutJoint> cut_joints;
  std::vector<VectorXd> inputs;     // (n_v) generalized forces of a unit of each
  std::vector<LinearOutput> linear; // outputs, before those of `places`
  std::vector<PlaceOutput> places;
  VectorXd q, v; // at the start
  MethodKind method = MethodKind::dop853;
  double spectral_radius = 0.8; // of generalized-alpha
  double tolerance = 1e-6;      // over `duration` (s)
  double duration = 1;

  FFROBOT_FIELDS(guid, bodies, ground, rows, gravity, joint_forces, gears, wrenches, cut_joints, inputs, linear, places,
                 q, v, method, spectral_radius, tolerance, duration);
};

std::string bytes_of(const ForwardModel &model);
// Throws std::runtime_error for bytes that are none of bytes_of().
ForwardModel forward_model_of(const std::string &bytes);

// Where a motion is, and how its integration came there.
struct ForwardState {
  VectorXd y; // (q, v)
  IntegrationCheckpoint steps;
  recursion::MotionHistory motion;
  std::vector<double> inputs;
};

class ForwardMotion {
public:
  // Throws std::invalid_argument where the model does not fit together.
  explicit ForwardMotion(ForwardModel model);
  ForwardMotion(const ForwardMotion &) = delete;
  ForwardMotion &operator=(const ForwardMotion &) = delete;

  const ForwardModel &model() const { return model_; }
  std::vector<double> &inputs() { return inputs_; } // held from now on
  std::size_t output_count() const { return model_.linear.size() + 3 * model_.places.size(); }

  // From time t over h (s) by steps of the integrator, whose errors keep to the tolerance times h / duration: those of
  // all steps together keep to the tolerance.
  IntegrationStatus step(double t, double h);

  const std::vector<double> &outputs(); // now: evaluated when first asked for after a step

  // What was kept of this model is brought back: explicit methods go on with the very steps that they took from there.
  ForwardState state() const { return {y_, history_, motion_->history(), inputs_}; }
  void bring_back(const ForwardState &state);

private:
  static recursion::Scene scene_of(const ForwardModel &model);

  ForwardModel model_;
  recursion::Mechanism<recursion::Spatial> mechanism_;
  recursion::Scene scene_;
  VectorXd y_;                                                           // (q, v)
  std::optional<recursion::RecursiveMotion<recursion::Spatial>> motion_; // there from the constructor on
  IntegrationCheckpoint history_;                                        // of the step before
  std::vector<double> inputs_, outputs_;
  bool outputs_are_old_ = true;
};

} // namespace ffrobot
