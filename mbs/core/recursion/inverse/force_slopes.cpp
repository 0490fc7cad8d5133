#include "core/recursion/inverse/force_slopes.h"

#include "core/linear/products.h"
#include "core/recursion/motion/natural_sizes.h"
#include "core/recursion/motion/postures.h"
#include "core/recursion/motion/scene_forces.h"

#include <algorithm>

namespace ffrobot::recursion {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

template <class Space>
Derivatives derivatives_under(const Mechanism<Space> &m, const Scene &scene, double t, const VectorXd &state,
                              const VectorXd &forces, const VectorXd &target, const Workspace<Space, double> &w,
                              bool by_forces) {
  VectorXd wrench = VectorXd::Zero(Space::dim * m.wrenches.size());
  VectorXd along_cuts = VectorXd::Zero(scene.cut_joints.size());
  for (const PointLoad &load : scene.point_loads)
    wrench[Space::dim * load.wrench + load.component] += load.share * load.magnitude(t).value;
  for (const CutLoad &load : scene.cut_loads)
    along_cuts[load.joint] += load.share * load.magnitude(t).value;
  return derivatives(m, w, state.data(), state.data() + m.n_q, Forces<double>{forces.data(), wrench.data()},
                     {scene.cut_joints, along_cuts.data(), scene.point_forces, t, NaturalSizes<Space>(m).length()},
                     target.data(), by_forces);
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

namespace {

// A mechanism that stands still at q; markers that follow a path stand, too.
template <class Space> struct AtRest {
  AtRest(const Mechanism<Space> &m, const Scene &scene, double t, const VectorXd &q, Workspace<Space, double> &w)
      : t(t), q(q), still(VectorXd::Zero(m.n_v)), w(w), forces(m), acting(m, scene, nullptr, nullptr),
        wrench(VectorXd::Zero(Space::dim * m.wrenches.size())) {
    turn_markers(scene, t, w);
    for (Turning &marker : w.turning)
      marker.omega.setZero(), marker.alpha.setZero();
  }

  // C_q^T lambda less forces of gravity, elasticity and loads; what acts along coordinates is in `acting`.
  VectorXd required(const double *lambda) {
    if (const double *at_wrenches = acting.at(t, q.data(), still.data(), w).forces.wrench)
      wrench = Eigen::Map<const VectorXd>(at_wrenches, wrench.size());
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
ForcesAtRest forces_at_rest(const Mechanism<Space> &m, const Scene &scene, double t, const VectorXd &q,
                            Workspace<Space, double> &w) {
  const Index rows = m.constraints.size();
  AtRest<Space> at(m, scene, t, q, w);
  ForcesAtRest found{{}, VectorXd(rows), MatrixXd(rows, m.n_v), 0, 0};
  if (rows) {
    found.C_q = gradients(m, q.data(), w);
    VectorXd rate(rows);
    measure(m, q.data(), at.still.data(), w, found.value.data(), rate.data());
    take_off(targets_at(scene, t), m.constraints, found.value, rate);
  }
  found.Q = -at.required(nullptr);
  if (const double *along = at.acting.generalized())
    found.Q += Eigen::Map<const VectorXd>(along, m.n_v);
  const auto meet = [&](const double *x) {
    const Eigen::Map<const Eigen::Vector<double, Space::dim>> both(x);
    found.force = std::max(found.force, both.template head<Space::linear>().norm());
    found.moment = std::max(found.moment, both.template tail<Space::dim - Space::linear>().norm());
  };
  for (std::size_t i = 0; i < m.nodes.size(); ++i)
    meet(at.forces.in_global_axes(i, w).data());
  for (Index i = 0; i < at.wrench.size(); i += Space::dim)
    meet(at.wrench.data() + i);
  return found;
}

template <class Space>
MatrixXd stiffness_at_rest(const Mechanism<Space> &m, const Scene &scene, double t, const VectorXd &q,
                           const VectorXd &lambda, const std::vector<int> &independent, Workspace<Space, double> &w) {
  AtRest<Space> at(m, scene, t, q, w);
  VectorXd state = VectorXd::Zero(m.n_q + m.n_v);
  state.head(m.n_q) = q;
  // The gradients of equations that are coordinates of joints do not change, and all motors may be locked by such ones.
  VectorXd changing = VectorXd::Zero(lambda.size());
  std::vector<int> kept;
  for (const int r : independent)
    if (m.constraints[r].model.kind != ConstraintKind::coordinate)
      changing[r] = lambda[r], kept.push_back(r);
  // Under these forces nothing accelerates, and `changing` are the multipliers that the elimination finds.
  const VectorXd forces = at.required(changing.data());
  w.keep(kept);
  const Derivatives found = derivatives_under(m, scene, t, state, forces, VectorXd::Zero(lambda.size()).eval(), w);
  MatrixXd K = -matrix_product(mass_matrix(q.data(), at.forces, w), found.a_q), unused = MatrixXd::Zero(m.n_v, m.n_v);
  add_transposed_product(found.value_q, found.lambda_q, K, -1);
  add_slopes(scene, q.data(), at.still.data(), K, unused);
  return K;
}

#define FFROBOT_INSTANTIATE(Space)                                                                                     \
  template Derivatives derivatives_under(const Mechanism<Space> &, const Scene &, double, const VectorXd &,            \
                                         const VectorXd &, const VectorXd &, const Workspace<Space, double> &, bool);  \
  template MatrixXd mass_matrix(const double *, NewtonEuler<Space> &, Workspace<Space, double> &);                     \
  template ForcesAtRest forces_at_rest(const Mechanism<Space> &, const Scene &, double, const VectorXd &,              \
                                       Workspace<Space, double> &);                                                    \
  template MatrixXd stiffness_at_rest(const Mechanism<Space> &, const Scene &, double, const VectorXd &,               \
                                      const VectorXd &, const std::vector<int> &, Workspace<Space, double> &);
FFROBOT_INSTANTIATE(Planar)
FFROBOT_INSTANTIATE(Spatial)
#undef FFROBOT_INSTANTIATE

} // namespace ffrobot::recursion
