// The constrained articulated-body algorithm with modes eliminated, for any body and joint; this is its backward pass.
// (E. P. Popov, A. F. Vereshchagin and S. L. Zenkevich, Manipulyatsionnye roboty, 1978; A. S. Sathya and J. Carpentier,
// Constrained articulated body dynamics algorithms, IEEE T-RO 41, 2024; without constraints R. Featherstone, Rigid Body
// Dynamics Algorithms, 2008, ch. 7; modes as in A. A. Shabana, Dynamics of Multibody Systems, ch. 5.)
//
//   here       in the literature
//   M, H       articulated inertia I^A and, by columns, [p^A | K^A]: bias force, forces of unit multipliers
//   U, D       of a joint: I^A S and S^T I^A S; in pin_joints.h U D^-1
//   S          Lambda^-1 = C M^-1 C^T, inverse inertia in constraint space, L^A (Delassus matrix, delassus.h)
//   S[.][0]    what constraint equations measure by forces, l^A; gamma: by velocities and the ground's acceleration
//
// Accelerations are classical ones, of a point of the body in axes of the body, and the ground accelerates with -g: no
// velocity but the angular one enters. m: rows of the frame in the mass matrix, P: rows of a port, M_ff = I:
//     p_ddot = Q_f - m^T A + sum of P^T f        A_port = X A + beta + G f,  X = X_rigid - P m^T,  G = P P^T
// The child's subtree, of articulated inertia Lambda and bias pi, exerts f = -Lambda A_port - pi, so that
//     f = -Y (X A + beta) - E pi       Y = (Lambda^-1 + G)^-1     E = I - Y G
//     M += X^T Y X     bias += X^T (Y beta + E pi)
// and the joint is eliminated: with u = S^T bias - tau,
//     Lambda = M - U D^-1 U^T     pi = bias - U D^-1 u + Lambda c
// The bias of unit multipliers, K, goes along in columns beside that of the forces. Each elimination leaves its part of
// C M^-1 C^T: u u^T / D at a joint, pi^T G E pi at a port.
#pragma once

#include "core/recursion/constrained_aba/ports.h"

namespace ffrobot::recursion {

// M and H in axes of the port of the parent, with what velocities do at the joint: pi = H + M c.
template <class Space, class T, int W>
inline void propagate_to_parent(const Node<Space> &node, Workspace<Space, T> &w, const Pack<T, Space::dim> *M,
                                Pack<T, W> *H, Pack<T, W> &gamma) {
  constexpr int d = Space::dim, stride = stride_of(W);
  using Cols = Pack<T, W>;
  const Hinge<Space, T> &hinge = w.hinges[node.index];
  auto by_velocity = Pack<T, d>::zero(); // M c, M symmetric
  for (int i = node.shape.is_centred ? Space::linear : 0; i < d; ++i) {
    by_velocity += hinge.c[i] * M[i];
    if (W > 1)
      gamma += hinge.c[i] * H[i];
  }
  for (int i = 0; i < d; ++i)
    H[i].add(0, by_velocity[i]);
  if constexpr (d == 6)
    if (node.rotor_inertia > 0)
      H[3].add(0, hinge.gyro[0]), H[4].add(0, hinge.gyro[1]);
  Cols P[d];
  if (!node.shape.is_centred)
    Space::template Turn<T>::add_moment(hinge.r, H);
  hinge.turn.apply(H, P);
  if (node.parent < 0) {
    T A[d];
    ground_acceleration(w.m, node.parent_port, A);
    for (int i = 0; i < d; ++i)
      gamma += A[i] * P[i];
    return;
  }
  T *to = w.force.data() + node.parent_port * d * stride;
  if (w.m.cleared[node.parent_port])
    for (int i = 0; i < d; ++i)
      P[i] += Cols::read(to + i * stride);
  for (int i = 0; i < d; ++i)
    P[i].write(to + i * stride);
}

// A body after its children: its ports, its modes, its joint.
template <class Space, class T, int W>
inline void eliminate_body(const Node<Space> &node, const T *q, const T *v, const Forces<T> &forces,
                           Workspace<Space, T> &w, Delassus<T, W> &S, Pack<T, W> &gamma) {
  constexpr int d = Space::dim;
  using Cols = Pack<T, W>;
  // M becomes Lambda, where that is in axes of the section
  Pack<T, d> own[d], *M = node.shape.free_are_axes ? w.hinges[node.index].Lambda : own;
  T b[d];
  auto &state = w.bodies[node.index];
  evaluate_inertia(node, q + node.p_q(), v + node.p_v(), state, M, b);
  Cols H[d];
  for (int i = 0; i < d; ++i)
    H[i] = Cols::zero(), H[i].set(0, b[i]);
  if (node.ports())
    eliminate_ports(node, w, M, H, S, gamma);
  if (node.inboard >= 0)
    move_to_section(node, w, M, H, S);
  eliminate_joint(node, q + node.q, forces.generalized ? forces.generalized + node.v : nullptr, w, M, H, S);
  propagate_to_parent(node, w, M, H, gamma);
}

} // namespace ffrobot::recursion
