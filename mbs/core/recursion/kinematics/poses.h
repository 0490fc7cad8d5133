// Where frames and sections are and how they move, in global axes: the end of the first pass.
#pragma once

#include "core/recursion/kinematics/spatial.h"

namespace ffrobot::recursion {

// Motions are poses without axes, which take sines or products of matrices.

template <class T> FFROBOT_INLINE void ground_motion(const PlanarMarker &marker, Pose<T> &to) {
  for (int i = 0; i < 3; ++i)
    to.r[i] = T(i < 2 ? marker.position[i] : 0.), to.v[i] = to.omega[i] = T(0.);
  to.angle = T(marker.angle);
}
template <class T> FFROBOT_INLINE void ground_axes(const PlanarMarker &marker, Pose<T> &to) {
  assign_turn_about_z(T(std::cos(marker.angle)), T(std::sin(marker.angle)), to.R);
}
template <class T> FFROBOT_INLINE void ground_motion(const SpatialMarker &marker, Pose<T> &to) {
  for (int i = 0; i < 3; ++i)
    to.r[i] = T(marker.position[i]), to.v[i] = to.omega[i] = T(0.);
  to.angle = T(0.);
}
template <class T> FFROBOT_INLINE void ground_axes(const SpatialMarker &marker, Pose<T> &to) {
  assign(marker.triad, to.R);
}

// Of a section of a body whose frame is known
template <class T>
inline void section_motion(const planar::Body &body, int port, const planar::State<T> &s, const Pose<T> &frame,
                           Pose<T> &to) {
  const planar::Port &constants = body.ports[port];
  const T *u = s.u.data() + constants.row, *u_dot = s.u_dot.data() + constants.row;
  const T x = constants.x + u[0], y = constants.y + u[1];
  const T x_dot = u_dot[0] - s.omega * y, y_dot = u_dot[1] + s.omega * x;
  const T c = s.absolute_cosine, n = s.absolute_sine;
  to.r[0] = frame.r[0] + c * x - n * y, to.r[1] = frame.r[1] + n * x + c * y, to.r[2] = T(0.);
  to.v[0] = frame.v[0] + c * x_dot - n * y_dot, to.v[1] = frame.v[1] + n * x_dot + c * y_dot, to.v[2] = T(0.);
  to.omega[0] = to.omega[1] = T(0.), to.omega[2] = s.omega + u_dot[2];
  to.angle = frame.angle + constants.angle + u[2];
}
template <class T>
inline void section_axes(const planar::Body &, int, const planar::State<T> &, Pose<T> &to) { // after section_motion()
  T sine, cosine;
  sine_and_cosine(to.angle, sine, cosine);
  assign_turn_about_z(cosine, sine, to.R);
}
template <class T>
inline void section_motion(const spatial::Body &body, int port, const spatial::State<T> &s, const Pose<T> &frame,
                           Pose<T> &to) {
  const spatial::Port &constants = body.ports[port];
  const spatial::PortMotion<T> &motion = s.ports[port];
  T r[3], v[3], omega[3], turned[3];
  turn(s.absolute, motion.r, r);
  cross(s.omega, motion.r, v);
  for (int i = 0; i < 3; ++i)
    omega[i] = s.omega[i];
  if (constants.is_flexible) {
    turn(constants.R, s.u_dot.data() + constants.row, turned);
    for (int i = 0; i < 3; ++i)
      v[i] += turned[i];
    turn(constants.R, motion.rate, turned);
    for (int i = 0; i < 3; ++i)
      omega[i] += turned[i];
  }
  turn(s.absolute, v, turned);
  turn(s.absolute, omega, to.omega);
  for (int i = 0; i < 3; ++i)
    to.r[i] = frame.r[i] + r[i], to.v[i] = frame.v[i] + turned[i];
  to.angle = T(0.);
}
template <class T>
inline void section_axes(const spatial::Body &body, int port, const spatial::State<T> &s, Pose<T> &to) {
  const spatial::Port &constants = body.ports[port];
  product(s.absolute, constants.R, to.R);
  if (constants.is_flexible)
    product(to.R, s.ports[port].turn, to.R);
}
template <class Body, class State, class T>
inline void section_pose(const Body &body, int port, const State &s, const Pose<T> &frame, Pose<T> &to) {
  section_motion(body, port, s, frame, to), section_axes(body, port, s, to);
}

template <class T> FFROBOT_INLINE void frame_axes(const planar::State<T> &s, Pose<T> &to) {
  to.omega[0] = to.omega[1] = T(0.), to.omega[2] = s.omega;
  assign_turn_about_z(s.absolute_cosine, s.absolute_sine, to.R);
}
template <class T> FFROBOT_INLINE void frame_axes(const spatial::State<T> &s, Pose<T> &to) {
  turn(s.absolute, s.omega, to.omega);
  assign(s.absolute, to.R);
}

template <class T> FFROBOT_INLINE T joint_angle(const Node<Planar> &node, const T *q, const planar::State<T> &s) {
  if (node.joint == JointKind::revolute)
    return node.body.is_tilted ? T(q[node.q] - s.u[planar::Body::TILT]) : q[node.q];
  return node.joint == JointKind::planar ? q[node.q + 2] : T(0.);
}
template <class T> FFROBOT_INLINE T joint_angle(const Node<Spatial> &, const T *, const spatial::State<T> &) {
  return T(0.);
}

// Of all frames: w.frames
template <class Space, class T> FFROBOT_NOINLINE void locate(const T *q, Workspace<Space, T> &w) {
  for (std::size_t i = 0; i < w.m.nodes.size(); ++i) {
    const Node<Space> &node = w.m.nodes[i];
    const Hinge<Space, T> &hinge = w.hinges[i];
    Pose<T> inner;
    if (node.parent < 0)
      ground_motion(w.m.ground[node.parent_port], inner);
    else
      section_motion(w.m.nodes[node.parent].body, node.parent_port - w.m.nodes[node.parent].first_port,
                     w.bodies[node.parent], w.frames[node.parent], inner);
    Pose<T> &frame = w.frames[i];
    frame_axes(w.bodies[i], frame);
    // origin and velocity of the outer section; its axes are those of the frame, or of the inboard port
    frame.angle = inner.angle + joint_angle(node, q, w.bodies[i]);
    T r[3] = {T(0.), T(0.), T(0.)}, r_dot[3] = {T(0.), T(0.), T(0.)}, arm[3], rate[3], swept[3];
    Pose<T> local = frame, section = frame;
    if (node.inboard >= 0) {
      for (int k = 0; k < 3; ++k)
        local.r[k] = local.v[k] = T(0.);
      local.angle = T(0.);
      section_pose(node.body, node.inboard, w.bodies[i], local, section); // relative to the frame's origin
      if constexpr (Space::dim == 3) { // section_pose measures angles from the frame's
        const T tilt = section_angle(node.body, node.inboard, w.bodies[i]);
        frame.angle -= tilt;
        T s, c;
        sine_and_cosine(frame.angle + tilt, s, c);
        assign_turn_about_z(c, s, section.R);
      }
    }
    for (int k = 0; k < Space::linear; ++k)
      r[k] = hinge.r[k], r_dot[k] = hinge.r_dot[k];
    turn(section.R, r, arm), turn(section.R, r_dot, rate), cross(inner.omega, arm, swept);
    for (int k = 0; k < 3; ++k) {
      frame.r[k] = inner.r[k] + arm[k], frame.v[k] = inner.v[k] + swept[k] + rate[k];
      if (node.inboard >= 0)
        frame.r[k] -= section.r[k], frame.v[k] -= section.v[k];
    }
  }
}

template <class Space, class T>
FFROBOT_INLINE void attachment_motion(const Attachment &at, const Workspace<Space, T> &w, Pose<T> &to) {
  if (at.node >= 0)
    return section_motion(w.m.nodes[at.node].body, at.port, w.bodies[at.node], w.frames[at.node], to);
  ground_motion(w.m.ground[at.port], to);
  if constexpr (Space::dim == 6)
    if (w.m.ground[at.port].turns)
      for (int i = 0; i < 3; ++i)
        to.omega[i] = T(w.turning[at.port].omega[i]);
}

template <class Space, class T>
FFROBOT_INLINE void attachment_pose(const Attachment &at, const Workspace<Space, T> &w, Pose<T> &to) {
  attachment_motion(at, w, to);
  if (at.node >= 0)
    return section_axes(w.m.nodes[at.node].body, at.port, w.bodies[at.node], to);
  ground_axes(w.m.ground[at.port], to);
  if constexpr (Space::dim == 6)
    if (w.m.ground[at.port].turns)
      assign(w.turning[at.port].A, to.R);
}

} // namespace ffrobot::recursion
