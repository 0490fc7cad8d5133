// What motions that are known take: mbs/core/recursion/newton_euler/newton_euler.h, at many states of a mechanism and
// its scene.
#pragma once

#include "core/recursion/inverse/motion_forces.h"

#include "bindings/recursion/tree_run.h"

namespace ffrobot::recursion {

// q (T, n_q), v and a (T, n_v) at times (T)
struct KnownStates {
  const std::vector<double> &times;
  const Rows &q, &v, &a;
};

// each(i, what acts, forces, workspace) at state i, after accelerate(); nothing acts along coordinates of `forces`
template <class Space, class Each>
void at_known_states(Model<Space> &model, const Scene &scene, const KnownStates &states, const Each &each) {
  const auto &[times, q, v, a] = states;
  const Index count = times.size();
  check_scene(model, scene);
  const auto check = [&](const Rows &of, Index columns) {
    check_size("states", of.rows(), count), check_size("coordinates", of.cols(), columns);
  };
  check(q, model.mechanism.n_q), check(v, model.mechanism.n_v), check(a, model.mechanism.n_v);
  if (count == 0)
    return;
  const nb::gil_scoped_release unlocked;
  RecursiveMotion<Space> motion(model.mechanism, scene, times[0], q.row(0).data(), v.row(0).data());
  NewtonEuler<Space> forces(model.mechanism);
  Workspace<Space, double> w(model.mechanism);
  for (Index i = 0; i < count; ++i) {
    const double t = times[i];
    turn_markers(scene, t, w);
    const Forces<double> acting = motion.act(t, q.row(i).data(), v.row(i).data());
    forces.prepare(q.row(i).data(), v.row(i).data(), nullptr, w);
    forces.accelerate(q.row(i).data(), a.row(i).data(), w);
    each(i, acting, forces, w);
  }
}

// Multipliers (T, rows) of `states`
inline void check_multipliers(const Rows &multipliers, Index states, Index rows) {
  check_size("times of multipliers", multipliers.rows(), states);
  check_size("multipliers", multipliers.cols(), rows);
}

// (T, n_v) M a - Q, with Q of gravity, elasticity, damping and all forces of the scene
template <class Space>
RowMajor required_forces(Model<Space> &model, const Scene &scene, const std::vector<double> &times, const Rows &q,
                         const Rows &v, const Rows &a) {
  RowMajor found(a.rows(), a.cols());
  at_known_states(model, scene, {times, q, v, a}, [&](Index i, const auto &acting, auto &forces, auto &w) {
    forces.load(nullptr, acting.wrench, w);
    forces.require(q.row(i).data(), a.row(i).data(), w, found.row(i).data());
    if (acting.generalized)
      found.row(i) -= Map<const RowVectorXd>(acting.generalized, found.cols());
  });
  return found;
}

// (T, rows) second derivatives of the rows' values, less those that their targets have
template <class Space>
RowMajor constraint_accelerations(Model<Space> &model, const Scene &scene, const std::vector<double> &times,
                                  const Rows &q, const Rows &v, const Rows &a) {
  RowMajor found(a.rows(), model.rows());
  at_known_states(model, scene, {times, q, v, a}, [&](Index i, const auto &, auto &forces, auto &w) {
    for (std::size_t r = 0; r < scene.targets.size(); ++r)
      found(i, r) = forces.of_constraint(r, a.row(i).data(), w).value - scene.targets[r](times[i]).acceleration;
  });
  return found;
}

// What bodies and joints do to each other, under multipliers (T, rows) and the forces of the scene
template <class Space>
MotionForces motion_forces(Model<Space> &model, const Scene &scene, const std::vector<double> &times, const Rows &q,
                           const Rows &v, const Rows &a, const Rows &multipliers) {
  check_multipliers(multipliers, a.rows(), model.rows());
  ForcesOfStates<Space> found(model.mechanism, a.rows());
  at_known_states(model, scene, {times, q, v, a}, [&](Index i, const auto &acting, auto &forces, auto &w) {
    const double *lambda = multipliers.row(i).data();
    forces.load(lambda, acting.wrench, w);
    found.write(i, q.row(i).data(), a.row(i).data(), lambda, forces, w);
  });
  return found.found();
}

// Joints and constraints alone, under multipliers (T, rows) alone
template <class Space>
MotionForces multiplier_forces(Model<Space> &model, const Scene &scene, const std::vector<double> &times, const Rows &q,
                               const Rows &multipliers) {
  check_multipliers(multipliers, q.rows(), model.rows());
  const RowMajor still = RowMajor::Zero(q.rows(), model.mechanism.n_v);
  ForcesOfStates<Space> found(model.mechanism, q.rows());
  at_known_states(model, scene, {times, q, still, still}, [&](Index i, const auto &, auto &forces, auto &w) {
    forces.load(multipliers.row(i).data(), nullptr, w);
    found.write_loads(i, multipliers.row(i).data(), forces, w);
  });
  return found.found();
}

} // namespace ffrobot::recursion
