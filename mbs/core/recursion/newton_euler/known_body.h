// What a known motion takes of the modes of one body, in the plane and in space, for the recursive Newton-Euler
// algorithm (newton_euler.h).
#pragma once

#include "core/recursion/newton_euler/planar_body.h"
#include "core/recursion/newton_euler/spatial_body.h"

namespace ffrobot::recursion {

// Of rows of W: W p_ddot, with geometric stiffening less p_dot^T K p_dot
template <class Body, class State> VectorXd elastic_accelerations(const Body &b, const State &s, const double *p_ddot) {
  if (b.n == 0)
    return VectorXd::Zero(b.row_count());
  VectorXd found = rows_of(b, s).lazyProduct(Map<const VectorXd>(p_ddot, b.n));
  if (b.stiffening)
    found -= Map<const VectorXd>(s.bent.curvature.data(), found.size());
  return found;
}

// Generalized forces on the modes: each(act) calls act(row of W, force).
template <class Body, class State, class Each>
void put_on_modes(const Body &b, const State &s, const Each &each, double *modal) {
  if (b.stiffening) {
    const auto W = rows_of(b, s);
    Map<VectorXd> sum(modal, b.n);
    sum.setZero();
    each([&](Index row, double force) { sum += force * W.row(row).transpose(); });
  } else
    in_registers(b.n, [&]<int width>(long k) { // the same of rows that are constant
      using Part = Pack<double, width>;
      const double *W = b.rows.data() + k;
      Part sum = Part::zero();
      each([&](Index row, double force) { sum += force * Part::read(W + row * padded(b.n)); });
      sum.write(modal + k);
    });
}

// m_ff p_ddot + m^T A - Q_f - sum of P^T f (n). z: by rows of W, -A and forces on ports
template <class Space, class State>
void modal_residual(const Node<Space> &node, const double *p, const double *p_ddot, double *z, State &s, double *to) {
  VectorXd by_forces(node.n());
  modes<false>(node, p, z, s, by_forces.data());
  const VectorXd beside = Map<const VectorXd>(p_ddot, node.n()) - by_forces;
  if (node.body.stiffening)
    s.bent.multiply_mass(beside.data(), to);
  else
    std::copy_n(beside.data(), node.n(), to);
}

} // namespace ffrobot::recursion
