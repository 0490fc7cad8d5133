// How forces answer to small changes of a state under a scene, by dual numbers: of motions that are known, and at rest.
#pragma once

#include "core/recursion/motion/scene.h"
#include "core/recursion/newton_euler/newton_euler.h"

namespace ffrobot::recursion {

// By increments of q (n_v; rotation vectors in body axes for quaternions), by v and by generalized forces; constraints
// hold.
struct Derivatives {
  MatrixXd a_q, a_v, a_f;      // (n_v, n_v) of accelerations
  MatrixXd lambda_q, lambda_v; // (constraints, n_v) of multipliers, 0 of constraints that are not kept
  MatrixXd value_q;            // (constraints, n_v) of values of constraints, C_q: by v of their rates, too
  MatrixXd rate_q;             // (constraints, n_v) of their rates
};

// Of accelerations at a state (q, v) at time t under generalized forces (n_v), what the scene does along coordinates
// among them, and its loads elsewhere, while the constraint equations that `w` keeps have `target` (constraints) as
// second derivatives. Markers of the ground stand and turn as there. By forces only if asked for.
template <class Space>
Derivatives derivatives_under(const Scene &scene, double t, const VectorXd &state, const VectorXd &forces,
                              const VectorXd &target, const Workspace<Space, double> &w, bool by_forces = false);

// M (n_v, n_v) at the state q of a prepare(); multipliers and loads are nothing to it.
template <class Space> MatrixXd mass_matrix(const double *q, NewtonEuler<Space> &forces, Workspace<Space, double> &w);

// Adds what springs and friction of the scene resist along coordinates, by increments of q and by v.
void add_slopes(const Scene &scene, const double *q, const double *v, MatrixXd &by_q, MatrixXd &by_v);

// At rest at q and time t, where what follows a path stands still; Q (n_v) are generalized forces of gravity,
// elasticity and the scene.
struct ForcesAtRest {
  VectorXd Q, value;    // value: of constraint equations less their targets
  MatrixXd C_q;         // (constraints, n_v)
  double force, moment; // N, N m: the largest that a joint transmits, or a load
};
template <class Space>
ForcesAtRest forces_at_rest(const Scene &scene, double t, const VectorXd &q, Workspace<Space, double> &w);

// K (n_v, n_v) there: the derivative of C_q^T lambda - Q by increments of q, at multipliers lambda (constraints), which
// are 0 of equations that are not independent.
template <class Space>
MatrixXd stiffness_at_rest(const Scene &scene, double t, const VectorXd &q, const VectorXd &lambda,
                           const std::vector<int> &independent, Workspace<Space, double> &w);

} // namespace ffrobot::recursion
