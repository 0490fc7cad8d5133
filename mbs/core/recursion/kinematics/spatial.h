// Outward, in space: orientations, angular velocities, what velocities do at joints.
#pragma once

#include "core/recursion/kinematics/planar.h"

namespace ffrobot::recursion {

namespace spatial {

// The inboard section of a joint: its axes against undeformed ones (null: the same), axes of the undeformed section
// in global ones, angular velocity in axes of the undeformed section.
template <class T> struct InnerSection {
  const T (*tilt)[3];
  T axes[3][3], omega[3];
};

template <class T>
FFROBOT_INLINE void inner_section(const Node<Spatial> &node, Workspace<Spatial, T> &w, InnerSection<T> &to) {
  to.tilt = nullptr;
  if (node.parent < 0) {
    to.omega[0] = to.omega[1] = to.omega[2] = T(0.);
    return assign(w.m.ground[node.parent_port].triad, to.axes);
  }
  const Node<Spatial> &parent = w.m.nodes[node.parent];
  const State<T> &p = w.bodies[node.parent];
  const int port = node.parent_port - parent.first_port;
  turn_back(parent.body.ports[port].R, p.omega, to.omega);
  product(p.absolute, parent.body.ports[port].R, to.axes);
  if (parent.body.ports[port].is_flexible) {
    for (int i = 0; i < 3; ++i)
      to.omega[i] += p.ports[port].rate[i];
    to.tilt = p.ports[port].turn;
  }
}

// R = tilt R_z, A = (R^T omega) x e_z q_dot
template <class T>
FFROBOT_INLINE void turn_revolute(const InnerSection<T> &inner, const T &s, const T &c, const T &v,
                                  Hinge<Spatial, T> &hinge, T *omega) {
  auto &R = hinge.turn.R;
  if (inner.tilt)
    for (int i = 0; i < 3; ++i) {
      R[i][0] = c * inner.tilt[i][0] + s * inner.tilt[i][1], R[i][1] = c * inner.tilt[i][1] - s * inner.tilt[i][0];
      R[i][2] = inner.tilt[i][2];
    }
  else
    assign_turn_about_z(c, s, R);
  turn_back(R, inner.omega, omega);
  hinge.c[3] = omega[1] * v, hinge.c[4] = -(omega[0] * v);
  omega[2] += v;
}

// A rotor on the inner section: its angular momentum J spin z turns with that section, in revolute joints.
template <class T>
FFROBOT_INLINE void spin_rotor(const Node<Spatial> &node, const T &v, const T *omega, Hinge<Spatial, T> &hinge) {
  const double c = node.rotor_turns, J = c * node.rotor_inertia;
  hinge.spin = c * omega[2] + (node.gear_ratio - c) * v;
  hinge.gyro[0] = J * hinge.spin * omega[1];
  hinge.gyro[1] = -(J * hinge.spin * omega[0]);
}

template <class T>
inline void turn_any(const Node<Spatial> &node, const InnerSection<T> &inner, const T *q, const T *v,
                     Hinge<Spatial, T> &hinge, T *omega) {
  SpatialPlace<T> to;
  place(node.joint, node.lead, q, v, to);
  if (inner.tilt)
    product(inner.tilt, to.R, hinge.turn.R);
  else
    assign(to.R, hinge.turn.R);
  hinge.cross_cosine = to.R[0][0], hinge.cross_sine = to.R[0][2];
  T o[3], or_[3], oor[3], or_dot[3], ow[3];
  turn_back(hinge.turn.R, inner.omega, o);
  cross(o, to.r, or_), cross(o, or_, oor), cross(o, to.r_dot, or_dot), cross(o, to.w, ow);
  for (int i = 0; i < 3; ++i) {
    hinge.r[i] = to.r[i], hinge.r_dot[i] = to.r_dot[i];
    hinge.c[i] = oor[i] + 2. * or_dot[i], hinge.c[3 + i] = ow[i] + to.w_dot[i];
    omega[i] = o[i] + to.w[i];
  }
}

// Forces and moments of 1 along the axes of the section, in axes of the port
template <class T> FFROBOT_INLINE void force_columns(const Node<Spatial> &node, Hinge<Spatial, T> &hinge) {
  const auto &R = hinge.turn.R;
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k)
      hinge.column[i][k] = hinge.column[3 + i][3 + k] = R[k][i];
  if (node.shape.is_centred)
    return;
  const T *r = hinge.r;
  for (int i = 0; i < 3; ++i) { // r x e_i = r_k e_j - r_j e_k
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    for (int l = 0; l < 3; ++l)
      hinge.column[i][3 + l] = r[k] * R[l][j] - r[j] * R[l][k];
  }
}

} // namespace spatial

template <class T>
FFROBOT_NOINLINE void kinematics(const T *q, const T *v, const Forces<T> &forces, Workspace<Spatial, T> &w) {
  Angles<T> angles;
  for (std::size_t i = 0; i < w.m.nodes.size(); ++i) {
    const bool turns = w.m.nodes[i].joint == JointKind::revolute;
    angles.take(i, w.m.nodes.size(), turns ? q[w.m.nodes[i].q] : T(0.), w.sine.data(), w.cosine.data());
  }
  for (std::size_t i = 0; i < w.m.nodes.size(); ++i) {
    const Node<Spatial> &node = w.m.nodes[i];
    spatial::State<T> &s = w.bodies[i];
    Hinge<Spatial, T> &hinge = w.hinges[i];
    project(node.body, q + node.p_q(), v + node.p_v(), forces.generalized ? forces.generalized + node.p_v() : nullptr,
            s);
    spatial::InnerSection<T> inner;
    spatial::inner_section(node, w, inner);
    if (node.joint == JointKind::revolute)
      spatial::turn_revolute(inner, w.sine[i], w.cosine[i], v[node.v], hinge, s.omega);
    else
      spatial::turn_any(node, inner, q + node.q, v + node.v, hinge, s.omega);
    if (node.rotor_inertia > 0)
      spatial::spin_rotor(node, v[node.v], s.omega, hinge);
    spatial::force_columns(node, hinge);
    product(inner.axes, hinge.turn.R, s.absolute);
    if (node.inboard >= 0) { // from the section to the frame
      const spatial::PortMotion<T> &port = s.ports[node.inboard];
      T undeformed[3];
      turn(port.turn, s.omega, undeformed);
      for (int k = 0; k < 3; ++k)
        undeformed[k] -= port.rate[k];
      turn(node.body.ports[node.inboard].R, undeformed, s.omega);
      for (T(&axis)[3] : s.absolute)
        turn(port.turn, axis, axis), turn(node.body.ports[node.inboard].R, axis, axis);
    }
    for (int k = 0; k < node.ports(); ++k)
      spatial::place_port(node.body, k, s);
  }
}

// Undeformed axes of the inboard port by those of the section there
template <class T> FFROBOT_INLINE SpatialTurn<T> inboard_tilt(const Node<Spatial> &node, const spatial::State<T> &s) {
  SpatialTurn<T> to;
  assign(s.ports[node.inboard].turn, to.R);
  return to;
}

template <class T>
FFROBOT_NOINLINE void evaluate_inertia(const Node<Spatial> &node, const T *, const T *, spatial::State<T> &s,
                                       Pack<T, 6> *M, T *b) {
  spatial::FrameTerms<T> found(M, b);
  inertia(node.body, s, found);
}

template <bool by_multipliers, class T>
FFROBOT_NOINLINE void modes(const Node<Spatial> &node, const T *, T *z, spatial::State<T> &s, T *a) {
  modal_accelerations<by_multipliers>(node.body, z, s, a);
}

template <class T> FFROBOT_INLINE void ground_acceleration(const Mechanism<Spatial> &m, int marker, T *A) {
  const Vector3d g = m.ground[marker].triad.transpose() * m.gravity;
  for (int i = 0; i < 3; ++i)
    A[i] = T(-g[i]), A[3 + i] = T(0.);
}

// y = R x from axes of a port to global ones
template <class X, class T>
FFROBOT_INLINE void port_to_global(const spatial::Body &b, int port, const spatial::State<T> &s, const X *x, X *y) {
  SpatialTurn<T> axes;
  product(s.absolute, b.ports[port].R, axes.R);
  axes.apply(x, y);
}

// As in the plane; x, y (6): translations
template <bool to_inner, class T>
FFROBOT_INLINE void change_section(const Node<Spatial> &node, const T *q, const T *x, T *y) {
  SpatialPlace<T> to;
  const T zero[6] = {T(0.), T(0.), T(0.), T(0.), T(0.), T(0.)};
  place(node.joint, node.lead, q, zero, to);
  to_inner ? turn(to.R, x, y) : turn_back(to.R, x, y);
  for (int i = 3; i < 6; ++i)
    y[i] = x[i];
}

} // namespace ffrobot::recursion
