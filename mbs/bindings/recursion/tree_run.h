// What a motion in joint coordinates is at outputs, and what its scene has to be like.
#pragma once

#include "bindings/recursion/recursion.h"
#include "core/analysis/replay.h"
#include "core/check_index.h"
#include "core/integrate/integrate.h"
#include "core/recursion/motion/postures.h"

namespace ffrobot::recursion {

template <class Space> void check_scene(const Model<Space> &model, const Scene &scene) {
  check_size("targets", scene.targets.size(), model.rows());
  const int n_q = model.mechanism.n_q, n_v = model.mechanism.n_v;
  for (const Load &load : scene.loads)
    for (const auto &[i, share] : load.along)
      check_index("coordinate of a load", i, n_v);
  for (const PointLoad &load : scene.point_loads) {
    check_index("wrench of a load", load.wrench, model.mechanism.wrenches.size());
    check_index("component of a load", load.component, Space::dim);
  }
  for (const PointForce &force : scene.point_forces) {
    check_index("wrench of a force", force.wrench, model.mechanism.wrenches.size());
    if (Space::dim == 3 && !force.function.is_planar)
      throw std::invalid_argument("forces of the motion of points: expected planar functions in the plane");
  }
  for (const JointForce &force : scene.joint_forces)
    check_index("q of a joint's force", force.q, n_q), check_index("v of a joint's force", force.v, n_v);
  for (const GearSpring &gear : scene.gears)
    for (const GearSpring::Side &side : {gear.a, gear.b})
      check_index("q of a gear", side.q, n_q), check_index("v of a gear", side.v, n_v);
  for (const CutJoint &cut : scene.cut_joints)
    for (const int wrench : {cut.a, cut.b})
      check_index("wrench of a cut joint", wrench, model.mechanism.wrenches.size());
  for (const CutLoad &load : scene.cut_loads)
    check_index("joint of a load", load.joint, scene.cut_joints.size());
  for (const LimitedCoordinate &limited : scene.limits) {
    check_index("coordinate of a limit", limited.v, n_v);
    for (const Index first : model.mechanism.rotations)
      if (first <= limited.v && limited.v < first + 3)
        throw std::invalid_argument("coordinate of a limit: expected a number, found a part of an orientation");
  }
  if (!scene.modal_amplitude_limits.empty())
    check_size("modal_amplitude_limits", scene.modal_amplitude_limits.size(), model.mechanism.nodes.size());
  if (scene.watch)
    check_size("is_path", scene.watch->is_path.size(), model.rows());
  for (const DrivenMarker &driven : scene.driven)
    check_index("marker of the ground", driven.marker, model.mechanism.ground.size());
}

template <class Space> void check_hold(const Model<Space> &model, const ZeroOrderHold &held) {
  check_size("rows of held forces", held.direction().rows(), model.mechanism.n_v);
  for (const auto &[input, share] : held.frame_motors()) {
    check_index("input of a motor on frames", input, held.direction().cols());
    for (const Index k : {Index(0), share.Phi_r.cols() - 1}) {
      check_index("q of a motor on frames", share.q + k, model.mechanism.n_q);
      check_index("v of a motor on frames", share.v + k, model.mechanism.n_v);
    }
  }
}

template <class Space> void check_replay(const Model<Space> &model, const Replay &replay) {
  check_hold(model, replay.along());
  for (const auto &[number, entry, share] : replay.at_points())
    check_index("entry of wrenches", entry, Space::dim * model.mechanism.wrenches.size());
}

// Where a run has stopped, and all that its next step depends on.
struct TreeCheckpoint {
  IntegrationCheckpoint integration;
  MotionHistory history;
  std::vector<RangeSeen> ranges; // of the scene's limits

  FFROBOT_FIELDS(integration, history, ranges);
};

// As far as it got.
struct TreeRun : IntegrationReport, PostureHistory { // of the scene's watch
  VectorXd last;                                     // (q, v) of the last accepted step
  RowMajor states, accelerations, lambda;            // (T, n_q + n_v), (T, n_v), (T, rows)
  RowMajor replayed;                                 // (T, numbers of its source) what a replay does
  std::vector<RangeSeen> ranges;                     // of the scene's limits

  template <class Space> TreeRun(const Model<Space> &model, std::size_t count) {
    const Index T = count;
    const Index n = model.mechanism.n_q + model.mechanism.n_v;
    last.resize(n), states.resize(T, n), accelerations.resize(T, model.mechanism.n_v), lambda.resize(T, model.rows());
    replayed.resize(T, 0);
  }

  // All that is read off a state (q, v), into row i; `reader` evaluates it, under `replay` if that is not null.
  // Interpolated states (`is_interpolated`) leave the constraint equations: they are moved back onto these along
  // M^-1 C^T of the first evaluation, and where that moves them they are evaluated again.
  template <class Space>
  void evaluate(std::size_t output, double t, const double *state, RecursiveMotion<Space> &reader, int n_q,
                bool is_interpolated, const Replay *replay) {
    const Index i = output;
    double *q = states.row(i).data(), *v = q + n_q, *a = accelerations.row(i).data();
    std::copy_n(state, states.cols(), q);
    reader.evaluate(t, q, v, a), reader.renew(t, q, v, a);
    if (is_interpolated) {
      reader.project(t, q, v);
      if (!std::equal(q, q + states.cols(), state))
        reader.evaluate(t, q, v, a);
    }
    lambda.row(i) = Map<const RowVectorXd>(reader.workspace().lambda.data(), lambda.cols());
    if (replay) {
      const VectorXd &values = replay->source().values();
      if (replayed.cols() != values.size())
        replayed.resize(replayed.rows(), values.size());
      replayed.row(i) = values.transpose();
    }
  }

  // What only the end of an integration tells
  template <class Space> void finish(RecursiveMotion<Space> &motion) {
    motion.watch_posture(time, last.data());
    static_cast<PostureHistory &>(*this) = motion.postures();
    for (auto *x : {&states, &accelerations, &lambda, &replayed})
      x->conservativeResize(outputs, Eigen::NoChange);
  }
};

// What a run reports of states (T, n_q + n_v) that are known; act(i) before each, has `held` act as it does there.
template <class Space, class Act>
TreeRun outputs_at(const Model<Space> &model, const Scene &scene, const std::vector<double> &times, const Rows &states,
                   const ZeroOrderHold *held, Replay *replay, const Act &act) {
  check_scene(model, scene);
  check_size("states", states.cols(), model.mechanism.n_q + model.mechanism.n_v);
  check_size("times", times.size(), states.rows());
  TreeRun run(model, times.size());
  if (times.empty())
    return run;
  const double *first = states.row(0).data();
  act(0);
  RecursiveMotion<Space> reader(model.mechanism, scene, times.front(), first, first + model.mechanism.n_q, held,
                                replay);
  for (Index i = 0; i < states.rows(); ++i) {
    act(i);
    const std::size_t output = i;
    run.evaluate(output, times[output], states.row(i).data(), reader, model.mechanism.n_q, false, replay);
  }
  return run;
}

// The motion from (q, v) at the first of `times`, or on from a checkpoint, with outputs at all of them, which `reader`
// evaluates. Pointers may be null.
template <class Space>
TreeRun integrated(const Model<Space> &model, const Scene &scene, RecursiveMotion<Space> &motion,
                   RecursiveMotion<Space> &reader, const std::vector<double> &times, const VectorXd &q,
                   const VectorXd &v, const IntegrationControls &controls, const std::function<bool(double)> &carry_on,
                   Companions with, TreeCheckpoint *checkpoint = nullptr, const Replay *replay = nullptr) {
  TreeRun run(model, times.size());
  run.last << q, v;
  motion.plan(times.front(), times.back());
  std::optional<LimitWatch> limits; // the reader is free while a step is looked at
  if (!scene.limits.empty())
    with.limits = &limits.emplace(scene.limits, motion, reader);
  if (checkpoint)
    with.checkpoint = &checkpoint->integration;
  if (checkpoint && checkpoint->integration.has_begun()) {
    check_size("ranges of coordinates", checkpoint->ranges.size(), scene.limits.size());
    if (limits)
      limits->go_on(checkpoint->ranges);
  }
  static_cast<IntegrationReport &>(run) = integrate(
      motion, times, run.last, controls,
      [&](std::size_t i, double t, const double *state) {
        run.evaluate(i, t, state, reader, model.mechanism.n_q, true, replay);
      },
      locked(carry_on), with);
  if (limits)
    run.ranges = limits->seen();
  if (checkpoint)
    checkpoint->history = motion.history(), checkpoint->ranges = run.ranges; // before what finish() looks at besides
  run.finish(motion);
  return run;
}

} // namespace ffrobot::recursion
