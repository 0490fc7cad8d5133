#include "core/recursion/inverse/force_slopes.h"

#include "core/linear/dense.h"
#include "core/recursion/motion/natural_sizes.h"
#include "core/recursion/motion/postures.h"
#include "core/recursion/motion/scene_forces.h"
#include "core/recursion/numbers/dual.h"

namespace ffrobot::recursion {

namespace {

constexpr Index directions = Dual::directions;

using Duals = std::vector<Dual>;

Duals constants(const VectorXd &x) { return {x.begin(), x.end()}; }

// Rate 1 in direction k
void seed(Dual &x, Index k, double rate = 1) { x.rate.add(static_cast<int>(k), rate); }

// q is incremented along v[i] in direction k; a quaternion e by e (0, dw)/2 for a rotation vector dw in body axes.
void seed_increment(const ConfigurationSpace &space, const double *q, Index i, Index k, Duals &to) {
  for (const auto &numbers : space.numbers())
    if (i >= numbers.v && i < numbers.v + numbers.count)
      seed(to[numbers.q + i - numbers.v], k);
  for (const auto &rotation : space.rotations()) {
    if (i < rotation.v || i >= rotation.v + 3)
      continue;
    const double *e = q + rotation.q;
    const double change[3][4] = {{-e[1], e[0], e[3], -e[2]}, {-e[2], -e[3], e[0], e[1]}, {-e[3], e[2], -e[1], e[0]}};
    for (Index j = 0; j < 4; ++j)
      seed(to[rotation.q + j], k, 0.5 * change[i - rotation.v][j]);
  }
}

Dual resistance(const Friction &friction, const Dual &rate) {
  return {friction.resistance(rate.value), friction.slope(rate.value) * rate.rate};
}

// Rates of x, in up to eight directions, to columns of `to` from `first` on
template <class Values> void take(const Values &x, Index first, Index count, MatrixXd &to) {
  for (Index j = 0; j < to.rows(); ++j)
    for (Index k = 0; k < count; ++k)
      to(j, first + k) = x[j].rate[static_cast<int>(k)];
}

// A mechanism that stands still at q; markers that follow a path stand, too.
template <class Space> struct AtRest {
  AtRest(const Scene &scene, double t, const VectorXd &q, Workspace<Space, double> &w)
      : t(t), q(q), still(VectorXd::Zero(w.m.n_v)), w(w), forces(w.m), acting(w.m, scene, nullptr, nullptr),
        wrench(VectorXd::Zero(Space::dim * w.m.wrenches.size())) {
    turn_markers(scene, t, w);
    for (Turning &marker : w.turning)
      marker.omega.setZero(), marker.alpha.setZero();
  }

  // C_q^T lambda less forces of gravity, elasticity and loads; what acts along coordinates is in `acting`.
  VectorXd required(const double *lambda) {
    if (const double *at_wrenches = acting.at(t, q.data(), still.data(), w).forces.wrench)
      wrench = Map<const VectorXd>(at_wrenches, wrench.size());
    VectorXd f(still.size());
    forces.prepare(q.data(), still.data(), nullptr, w);
    forces.accelerate(q.data(), still.data(), w);
    forces.load(lambda, wrench.data(), w);
    forces.require(q.data(), still.data(), w, f.data());
    return f;
  }

  const double t;
  const VectorXd &q, still;
  Workspace<Space, double> &w;
  NewtonEuler<Space> forces;
  SceneForces<Space> acting;
  VectorXd wrench;
};

} // namespace

template <class Space>
Derivatives derivatives_under(const Scene &scene, double t, const VectorXd &state, const VectorXd &forces,
                              const VectorXd &target, const Workspace<Space, double> &kept, bool by_forces) {
  const auto &m = kept.m;
  const auto &cuts = scene.cut_joints;
  const ConfigurationSpace space(m.n_v, m.rotations);
  const Index n = m.n_v, rows = m.constraints.size();
  const std::size_t n_v = n, n_rows = rows;
  const double length = NaturalSizes<Space>(m).length();
  VectorXd loads = VectorXd::Zero(Space::dim * m.wrenches.size()), along_cuts = VectorXd::Zero(cuts.size());
  for (const PointLoad &load : scene.point_loads)
    loads[Space::dim * load.wrench + load.component] += load.share * load.magnitude(t).value;
  for (const CutLoad &load : scene.cut_loads)
    along_cuts[load.joint] += load.share * load.magnitude(t).value;
  Workspace<Space, Dual> w(m);
  w.keep(kept.active), w.turning = kept.turning;
  const Duals q0 = constants(state.head(m.n_q)), v0 = constants(state.tail(n)), force0 = constants(forces);
  const Duals held = constants(target), wrench = constants(loads), given = constants(along_cuts);
  Duals a(n_v), value(n_rows), rate(n_rows), along(cuts.size()), acting_wrench;
  const auto answer = [&](const Duals &at_q, const Duals &at_v, const Duals &force) {
    const Placed<Space, Dual> placed = place_all(at_q.data(), at_v.data(), force.data(), w);
    acting_wrench = wrench;
    add_at_points(placed, scene.point_forces, t, length, acting_wrench.data());
    cut_rates(placed, cuts, along.data());
    for (std::size_t k = 0; k < along.size(); ++k)
      along[k] = given[k] - resistance(cuts[k].friction, along[k]);
    add_along_cuts(placed, cuts, along.data(), acting_wrench.data());
    accelerations(placed, acting_wrench.data(), held.data(), a.data());
  };
  const MatrixXd square(n, n), of_rows(rows, n);
  Derivatives found{square, square, square, of_rows, of_rows, of_rows, of_rows};
  for (Index first = 0; first < n; first += directions) {
    const Index count = std::min(directions, n - first);
    Duals q1 = q0, v1 = v0, force1 = force0;
    for (Index k = 0; k < count; ++k) {
      const std::size_t i = first + k;
      seed_increment(space, state.data(), first + k, k, q1), seed(v1[i], k), seed(force1[i], k);
    }
    answer(q1, v0, force0), take(a, first, count, found.a_q), take(w.lambda, first, count, found.lambda_q);
    answer(q0, v1, force0), take(a, first, count, found.a_v), take(w.lambda, first, count, found.lambda_v);
    if (by_forces)
      answer(q0, v0, force1), take(a, first, count, found.a_f);
    measure(q1.data(), v0.data(), w, value.data(), rate.data());
    take(value, first, count, found.value_q), take(rate, first, count, found.rate_q);
  }
  return found;
}

template <class Space> MatrixXd mass_matrix(const double *q, NewtonEuler<Space> &forces, Workspace<Space, double> &w) {
  const Index n = forces.mechanism().n_v;
  MatrixXd M(n, n);
  VectorXd unit = VectorXd::Zero(n), f(n);
  forces.load(nullptr, nullptr, w);
  forces.accelerate(q, unit.data(), w);
  forces.require(q, unit.data(), w, f.data());
  for (Index j = 0; j < n; ++j) {
    unit[j] = 1;
    forces.accelerate(q, unit.data(), w);
    forces.require(q, unit.data(), w, M.col(j).data());
    M.col(j) -= f;
    unit[j] = 0;
  }
  return M;
}

void add_slopes(const Scene &scene, const double *q, const double *v, MatrixXd &by_q, MatrixXd &by_v) {
  for (const JointForce &joint : scene.joint_forces) {
    by_q(joint.v, joint.v) += joint.stiffness;
    by_v(joint.v, joint.v) += joint.friction.slope(v[joint.v]);
  }
  for (const auto &[a, b, ratio, spring, damping] : scene.gears) {
    const double stiffness = spring.slope(q[a.q] - ratio * q[b.q]);
    for (const auto &[i, of_i] : {std::pair{a.v, 1.}, std::pair{b.v, -ratio}})
      for (const auto &[j, of_j] : {std::pair{a.v, 1.}, std::pair{b.v, -ratio}})
        by_q(i, j) += of_i * of_j * stiffness, by_v(i, j) += of_i * of_j * damping;
  }
}

template <class Space>
ForcesAtRest forces_at_rest(const Scene &scene, double t, const VectorXd &q, Workspace<Space, double> &w) {
  const Index rows = w.m.constraints.size();
  AtRest<Space> at(scene, t, q, w);
  ForcesAtRest found{{}, VectorXd(rows), MatrixXd(rows, w.m.n_v), 0, 0};
  if (rows) {
    found.C_q = gradients(q.data(), w);
    VectorXd rate(rows);
    measure(q.data(), at.still.data(), w, found.value.data(), rate.data());
    take_off(targets_at(scene, t), w.m.constraints, found.value, rate);
  }
  found.Q = -at.required(nullptr);
  if (const double *along = at.acting.generalized())
    found.Q += Map<const VectorXd>(along, w.m.n_v);
  const auto meet = [&](const double *x) {
    const Map<const Eigen::Vector<double, Space::dim>> both(x);
    found.force = std::max(found.force, both.template head<Space::linear>().norm());
    found.moment = std::max(found.moment, both.template tail<Space::dim - Space::linear>().norm());
  };
  for (std::size_t i = 0; i < w.m.nodes.size(); ++i)
    meet(at.forces.in_global_axes(i, w).data());
  for (Index i = 0; i < at.wrench.size(); i += Space::dim)
    meet(at.wrench.data() + i);
  return found;
}

template <class Space>
MatrixXd stiffness_at_rest(const Scene &scene, double t, const VectorXd &q, const VectorXd &lambda,
                           const std::vector<int> &independent, Workspace<Space, double> &w) {
  AtRest<Space> at(scene, t, q, w);
  VectorXd state = VectorXd::Zero(w.m.n_q + w.m.n_v);
  state.head(w.m.n_q) = q;
  // The gradients of equations that are coordinates of joints do not change, and all motors may be locked by such ones.
  VectorXd changing = VectorXd::Zero(lambda.size());
  std::vector<int> kept;
  for (const int r : independent)
    if (w.m.constraints[r].model.kind != ConstraintKind::coordinate)
      changing[r] = lambda[r], kept.push_back(r);
  // Under these forces nothing accelerates, and `changing` are the multipliers that the elimination finds.
  const VectorXd forces = at.required(changing.data());
  w.keep(kept);
  const Derivatives found = derivatives_under(scene, t, state, forces, VectorXd::Zero(lambda.size()).eval(), w);
  MatrixXd K = -matrix_product(mass_matrix(q.data(), at.forces, w), found.a_q),
           unused = MatrixXd::Zero(w.m.n_v, w.m.n_v);
  add_transposed_product(found.value_q, found.lambda_q, K, -1);
  add_slopes(scene, q.data(), at.still.data(), K, unused);
  return K;
}

#define FFROBOT_INSTANTIATE(Space)                                                                                     \
  template Derivatives derivatives_under(const Scene &, double, const VectorXd &, const VectorXd &, const VectorXd &,  \
                                         const Workspace<Space, double> &, bool);                                      \
  template MatrixXd mass_matrix(const double *, NewtonEuler<Space> &, Workspace<Space, double> &);                     \
  template ForcesAtRest forces_at_rest(const Scene &, double, const VectorXd &, Workspace<Space, double> &);           \
  template MatrixXd stiffness_at_rest(const Scene &, double, const VectorXd &, const VectorXd &,                       \
                                      const std::vector<int> &, Workspace<Space, double> &);
FFROBOT_INSTANTIATE(Planar)
FFROBOT_INSTANTIATE(Spatial)
#undef FFROBOT_INSTANTIATE

} // namespace ffrobot::recursion
