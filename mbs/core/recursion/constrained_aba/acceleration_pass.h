// Outward again: accelerations of joints, sections, ports and modes once the multipliers are known.
//
// `by_multipliers`: what the multipliers alone do to a system at rest, -M^-1 C^T lambda, for projections; y has a zero
// in front then.
#pragma once

#include "core/recursion/constrained_aba/backward_pass.h"

namespace ffrobot::recursion {

// What the columns of `slot` add up to
template <class Space, class T, int W>
FFROBOT_INLINE T superposed(const Workspace<Space, T> &w, int slot, const Pack<T, W> &y) {
  return (Pack<T, W>::read(w.stored.data() + slot * stride_of(W)) * y).sum();
}

// … of `count` slots from there on
template <int count, class Space, class T, int W>
FFROBOT_INLINE void superposed(const Workspace<Space, T> &w, int slot, const Pack<T, W> &y, T *to) {
  Pack<T, W> products[count];
  for (int i = 0; i < count; ++i)
    products[i] = Pack<T, W>::read(w.stored.data() + (slot + i) * stride_of(W)) * y;
  sums(products, to);
}

// What an active constraint equation prescribes of a freedom of the node's joint; null: none does
template <class Space, class T>
FFROBOT_INLINE const T *prescribed(const Node<Space> &node, const Hinge<Space, T> &hinge, const Workspace<Space, T> &w,
                                   int freedom) {
  return node.has_constraints && w.target && hinge.row[freedom] >= 0 ? w.target + hinge.row[freedom] : nullptr;
}

// Acceleration A of the section (in: as if the joint were stiff) and a of the joint; the force on the ground of a body
// that is alone. Coordinates that constraint equations prescribe do exactly what these say: sums of what multipliers
// and loads do to them are rounding, which sections with next to no inertia, as those of cantilever modes, amplify.
template <class Space, class T, int W>
inline void accelerate_joint(const Node<Space> &node, const T *q, Hinge<Space, T> &hinge, const Workspace<Space, T> &w,
                             const Pack<T, W> &y, T *A, T *a) {
  constexpr int d = Space::dim;
  T x[6];
  acceleration_by_freedoms<1>(node, hinge, A);
  if (node.is_single_grounded) {
    const auto by_section = symmetric_product(hinge.Lambda, A);
    for (int i = 0; i < d; ++i)
      hinge.f[i] = -(by_section[i] + superposed(w, node.ground_slot() + i, y));
  }
  for (int k = 0; k < node.shape.freedoms.count; ++k) {
    const int f = node.shape.freedoms.component[k];
    const T before = A[f];
    if (const T *target = W > 1 ? prescribed(node, hinge, w, k) : nullptr; target && !node.shape.in_inner_axes) {
      x[k] = *target;
      A[f] = before + x[k];
      continue;
    }
    if (node.rotor_inertia == 0)
      A[f] = T(0.);
    T sum = hinge.U[k][0] * A[0];
    for (int j = 1; j < d; ++j)
      sum += hinge.U[k][j] * A[j];
    const T found = -(superposed(w, node.joint_slot(k), y) + hinge.D_inverse[k] * sum);
    x[k] = node.rotor_inertia == 0 ? found - before : found;
    A[f] = node.rotor_inertia == 0 ? found : before + found;
  }
  acceleration_by_freedoms<-1>(node, hinge, A);
  if (node.shape.in_inner_axes) {
    const int linear = node.joint == JointKind::free ? Space::linear : 2;
    T u[6] = {x[0], x[1], linear == 3 ? x[2] : T(0.), T(0.), T(0.), T(0.)}, turned[6];
    change_section<true>(node, q, u, turned);
    for (int k = 0; k < linear; ++k)
      x[k] = turned[k];
  }
  for (int k = 0; k < node.shape.freedoms.count; ++k) {
    const T *target = W > 1 ? prescribed(node, hinge, w, k) : nullptr;
    a[k] = target ? *target : x[k];
  }
}

// Accelerations of ports, and forces f on those that modes move or that carry a joint, whose forces steps are judged
// by; the last eliminated first.
template <class Space, class T, int W>
inline void accelerate_ports(const Node<Space> &node, bool by_multipliers, Workspace<Space, T> &w, const Pack<T, W> &y,
                             const T *A) {
  constexpr int d = Space::dim, stride = stride_of(W);
  const int n = node.ports();
  for (int k = node.outboard - 1; k >= 0; --k) {
    PortWork<Space, T> &port = w.ports[node.first_port + k];
    T X_A[d];
    multiply(port.X, A, X_A);
    if (node.body.ports[k].is_flexible)
      for (int l = k + 1; l < n; ++l)
        if (node.body.ports[l].is_flexible) {
          const auto *K = w.cross.data() + (node.first_cross + cross_index(k, l, n)) * d;
          const T *f = w.ports[node.first_port + l].f;
          T Kf[d];
          multiply(K, f, Kf);
          for (int i = 0; i < d; ++i)
            X_A[i] += Kf[i];
        }
    auto moved = Pack<T, d>::zero(), held = moved;
    const bool is_flexible = node.body.ports[k].is_flexible, loaded = w.m.children[node.first_port + k] >= 0;
    if (loaded)
      held = symmetric_product(port.Y, X_A);
    if (is_flexible || loaded) {
      T answers[d];
      superposed<d>(w, node.port_slot(k), y, answers);
      for (int i = 0; i < d; ++i)
        port.f[i] = -(answers[i] + held[i]);
    }
    if (is_flexible)
      moved = symmetric_product(port.G, port.f);
    for (int i = 0; i < d; ++i) {
      port.A[i] = X_A[i] + moved[i];
      if (n > 1)
        port.A[i] += (Pack<T, W>::read(w.bias.data() + ((node.first_port + k) * d + i) * stride) * y).sum();
      else if (!by_multipliers)
        port.A[i] += port.beta[i];
    }
  }
}

template <class Space, class T, int W>
inline void accelerate_body(const Node<Space> &node, const T *q, bool by_multipliers, Workspace<Space, T> &w,
                            const Pack<T, W> &y, T *a) {
  constexpr int d = Space::dim;
  const int i_node = node.index;
  Hinge<Space, T> &hinge = w.hinges[i_node];
  auto &state = w.bodies[i_node];
  T *A = hinge.A, outer[d];
  if (node.parent < 0) {
    T ground[d];
    ground_acceleration(w.m, node.parent_port, ground);
    for (T &x : ground)
      x = by_multipliers ? T(0.) : x;
    hinge.turn.back(ground, outer);
  } else
    hinge.turn.back(w.ports[node.parent_port].A, outer);
  if (!node.shape.is_centred)
    Space::template Turn<T>::shift(hinge.r, outer);
  for (int i = 0; i < d; ++i)
    A[i] = by_multipliers ? outer[i] : outer[i] + hinge.c[i];
  accelerate_joint(node, q + node.q, hinge, w, y, A, a + node.v);
  T frame[packed<T, d>] = {}, *A_frame = A;
  T *z = w.z.data();
  if (node.body.n)
    for (int r = 0; r < node.body_width(); r += lanes)
      Pack<T, lanes>::zero().write(z + r);
  if (node.inboard >= 0) {
    PortWork<Space, T> &port = w.ports[node.first_port + node.inboard];
    const auto *R = w.soft.data() + w.first_soft[i_node];
    T A_section[packed<T, d>] = {};
    inboard_tilt(node, state).apply(A, A_section);
    multiply(R + d, A_section, port.f);
    for (int i = 0; i < d; ++i)
      port.f[i] += superposed(w, node.inboard_slot() + d + i, y);
    multiply(R, port.f, frame);
    for (int i = 0; i < d; ++i)
      frame[i] -= superposed(w, node.inboard_slot() + i, y);
    A_frame = frame;
    if (node.body.n)
      put_force(node.body, state, node.inboard, port.f, z);
  }
  for (int i = 0; i < d; ++i)
    state.A[i] = A_frame[i];
  accelerate_ports(node, by_multipliers, w, y, A_frame);
  if (node.body.n == 0)
    return;
  for (int i = 0; i < d; ++i)
    z[i] = -A_frame[i];
  for (int k = 0; k < node.outboard; ++k)
    put_force(node.body, state, k, w.ports[node.first_port + k].f, z);
  if (by_multipliers)
    modes<true>(node, q + node.p_q(), z, state, a + node.p_v());
  else
    modes<false>(node, q + node.p_q(), z, state, a + node.p_v());
}

} // namespace ffrobot::recursion
