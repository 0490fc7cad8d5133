// What a mechanism does at a state, in global axes: for outputs and tests, not for steps.
#pragma once

#include "core/recursion/motion/motion.h"
#include "core/recursion/motion/postures.h"

namespace ffrobot::recursion {

// Frames of all bodies after accelerations() and place_all(): position, acceleration, angular velocity and acceleration
// (3), in the plane with third components that are angles' or zero; R: body axes to global ones. Frames may sit at
// joints (mechanism.h): a_origin is the acceleration of the origin of the body's data.
struct FrameMotion {
  Vector3d r, a, omega, alpha;
  Matrix3d R;
  Vector3d a_origin;

  FFROBOT_FIELDS(r, a, omega, alpha, R, a_origin);
};

template <class Space> std::vector<FrameMotion> frame_motions(const Workspace<Space, double> &w);

// Of states q (T, n_q), v (T, n_v): of each frame and of each section on which wrenches may act (T, 18 each) position,
// axes (3, 3) row by row, velocity and angular velocity.
template <class Space> RowMajor motions_of_states(const RowMajor &q, const RowMajor &v, Workspace<Space, double> &w);

// Of forces with moments (T, dim of each body) on outer sections of joints, global axes, at q (T, n_q): what does no
// work along the joints' coordinates. Motors, loads and brakes do the rest, as forces along and moments about axes.
template <class Space> RowMajor without_work(const Rows &q, const Rows &forces, Workspace<Space, double> &w);

// Of states q (T, n_q), v (T, n_v), with what springs and friction of a scene store and dissipate: (T, 10) kinetic,
// strain and gravitational energy (J), the power (W) that is dissipated, and momentum: linear, angular about the origin
// (3 each).
template <class Space>
RowMajor totals_of_states(const Mechanism<Space> &m, const Scene &scene, const RowMajor &q, const RowMajor &v);

} // namespace ffrobot::recursion
