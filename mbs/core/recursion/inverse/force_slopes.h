// How forces answer to small changes of a state under a scene, by dual numbers: of motions that are known, and at rest.
#pragma once

#include "core/recursion/constrained_aba/derivatives.h"
#include "core/recursion/motion/scene.h"
#include "core/recursion/newton_euler/newton_euler.h"

namespace ffrobot::recursion {

// Of accelerations at a state (q, v) at time t under `forces` (n_v), what the scene does along coordinates among them,
// and its loads elsewhere, while the constraint equations that `w` keeps have `target` (constraints) as second
// derivatives.
template <class Space>
Derivatives derivatives_under(const Mechanism<Space> &m, const Scene &scene, double t, const Eigen::VectorXd &state,
                              const Eigen::VectorXd &forces, const Eigen::VectorXd &target,
                              const Workspace<Space, double> &w, bool by_forces = false);

// M (n_v, n_v) at the state q of a prepare(); multipliers and loads are nothing to it.
template <class Space>
Eigen::MatrixXd mass_matrix(const double *q, NewtonEuler<Space> &forces, Workspace<Space, double> &w);

// Adds what springs and friction of the scene resist along coordinates, by increments of q and by v.
void add_slopes(const Scene &scene, const double *q, const double *v, Eigen::MatrixXd &by_q, Eigen::MatrixXd &by_v);

// At rest at q and time t, where what follows a path stands still; Q (n_v) are generalized forces of gravity,
// elasticity and the scene.
struct ForcesAtRest {
  Eigen::VectorXd Q, value; // value: of constraint equations less their targets
  Eigen::MatrixXd C_q;      // (constraints, n_v)
  double force, moment;     // N, N m: the largest that a joint transmits, or a load
};
template <class Space>
ForcesAtRest forces_at_rest(const Mechanism<Space> &m, const Scene &scene, double t, const Eigen::VectorXd &q,
                            Workspace<Space, double> &w);

// K (n_v, n_v) there: the derivative of C_q^T lambda - Q by increments of q, at multipliers lambda (constraints), which
// are 0 of equations that are not independent.
template <class Space>
Eigen::MatrixXd stiffness_at_rest(const Mechanism<Space> &m, const Scene &scene, double t, const Eigen::VectorXd &q,
                                  const Eigen::VectorXd &lambda, const std::vector<int> &independent,
                                  Workspace<Space, double> &w);

} // namespace ffrobot::recursion
