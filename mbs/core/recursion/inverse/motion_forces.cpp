#include "core/recursion/inverse/motion_forces.h"

#include "core/recursion/constrained_aba/once.h"
#include "core/recursion/inverse/observe.h"

namespace ffrobot::recursion {

namespace {

using Motion = Map<Matrix<double, 9, 1>>;
using Axes = Map<Matrix<double, 3, 3, Eigen::RowMajor>>;

double *block(RowMajor &table, Index row, Index size, std::size_t number) {
  return table.row(row).data() + size * number;
}

// A force (3) and its moment (3), of which a space has some
template <class Space> void write_wrench(const double *force, const double *moment, double factor, double *to) {
  for (int k = 0; k < Space::linear; ++k)
    to[k] = factor * force[k];
  for (int k = Space::linear; k < Space::dim; ++k)
    to[k] = factor * moment[k + 3 - Space::dim];
}

// The same with three components each
template <class Space> std::array<Vector3d, 2> in_three_axes(const std::array<double, Space::dim> &x) {
  if constexpr (Space::dim == 3)
    return {Vector3d(x[0], x[1], 0), Vector3d(0, 0, x[2])};
  else
    return {Vector3d(x[0], x[1], x[2]), Vector3d(x[3], x[4], x[5])};
}

} // namespace

template <class Space> std::vector<std::array<int, 2>> ForcesOfStates<Space>::sections(const Mechanism<Space> &m) {
  std::vector<std::array<int, 2>> found;
  for (const Node<Space> &node : m.nodes)
    for (const int marker : node.markers)
      found.push_back({node.index, marker});
  return found;
}

template <class Space>
ForcesOfStates<Space>::ForcesOfStates(const Mechanism<Space> &mechanism, Index states) : mechanism_(mechanism) {
  const auto resize = [states](RowMajor &table, std::size_t size, std::size_t count) {
    table.setZero(states, size * count);
  };
  const std::size_t bodies = mechanism.nodes.size();
  resize(found_.bodies, 9, bodies), resize(found_.axes, 9, bodies), resize(found_.points, 9, mechanism.wrenches.size());
  resize(found_.sections, Space::dim, sections(mechanism).size()), resize(found_.joints, Space::dim, bodies);
  resize(found_.constraints, Space::dim, mechanism.constraints.size());
  resize(found_.modal, 1, mechanism.n_v), resize(found_.rotors, 3, bodies);
}

template <class Space>
void ForcesOfStates<Space>::write_loads(Index i, const double *lambda, NewtonEuler<Space> &forces,
                                        const Workspace<Space, double> &w) {
  forces.transmit(w, false);
  write_joints(i, forces, w);
  write_constraints(i, lambda, w);
}

template <class Space>
void ForcesOfStates<Space>::write_constraints(Index i, const double *lambda, const Workspace<Space, double> &w) {
  ConstraintMotion<double> motion;
  for (std::size_t r = 0; r < mechanism_.constraints.size(); ++r) {
    constraint_motion(mechanism_.constraints[r], w, mechanism_.constraints[r].moves, motion);
    write_wrench<Space>(motion.force, motion.moment_b, -lambda[r], block(found_.constraints, i, Space::dim, r));
  }
}

template <class Space>
void ForcesOfStates<Space>::write(Index i, const double *q, const double *a, const double *lambda,
                                  NewtonEuler<Space> &forces, Workspace<Space, double> &w) {
  write_constraints(i, lambda, w);
  forces.transmit(w);
  write_joints(i, forces, w);
  write_sections(i, forces, w);
  for (std::size_t k = 0; k < mechanism_.wrenches.size(); ++k)
    write_point(mechanism_.wrenches[k], forces, w, block(found_.points, i, 9, k));
  forces.require_of_modes(q, a, w, found_.modal.row(i).data());
  forces.leave_frames(w);
  const std::vector<FrameMotion> frames = frame_motions(w);
  for (std::size_t k = 0; k < frames.size(); ++k) {
    Motion(block(found_.bodies, i, 9, k)) << frames[k].a_origin, frames[k].alpha, frames[k].omega;
    Axes(block(found_.axes, i, 9, k)) = frames[k].R * mechanism_.nodes[k].axes;
  }
}

template <class Space>
void ForcesOfStates<Space>::write_joints(Index i, const NewtonEuler<Space> &forces, const Workspace<Space, double> &w) {
  for (std::size_t k = 0; k < mechanism_.nodes.size(); ++k)
    std::copy_n(forces.in_global_axes(k, w).data(), Space::dim, block(found_.joints, i, Space::dim, k));
}

template <class Space>
void ForcesOfStates<Space>::write_sections(Index i, const NewtonEuler<Space> &forces,
                                           const Workspace<Space, double> &w) {
  double *to = found_.sections.row(i).data();
  for (std::size_t k = 0; k < mechanism_.nodes.size(); ++k) {
    const Node<Space> &node = mechanism_.nodes[k];
    for (int port = 0; port < node.outboard; ++port, to += Space::dim)
      port_to_global(node.body, port, w.bodies[k], forces.on_port(node.first_port + port).data(), to);
    std::copy_n(forces.in_global_axes(k, w).data(), Space::dim, to), to += Space::dim;
    const Vector3d rotor = in_three_axes<Space>(forces.of_rotor(k))[1];
    std::copy_n(rotor.data(), 3, block(found_.rotors, i, 3, k));
  }
}

template <class Space>
void ForcesOfStates<Space>::write_point(const Attachment &at, const NewtonEuler<Space> &forces,
                                        const Workspace<Space, double> &w, double *to) const {
  if (at.node < 0)
    return;
  const std::size_t number = at.node;
  typename NewtonEuler<Space>::Vector global;
  port_to_global(mechanism_.nodes[number].body, at.port, w.bodies[number], forces.of_port(at.global_port).data(),
                 global.data());
  const auto [a, alpha] = in_three_axes<Space>(global);
  Pose<double> pose;
  attachment_motion(at, w, pose);
  Motion found(to);
  found << a, alpha, pose.omega[0], pose.omega[1], pose.omega[2];
  found.head(mechanism_.gravity.size()) += mechanism_.gravity;
}

template class ForcesOfStates<Planar>;
template class ForcesOfStates<Spatial>;

} // namespace ffrobot::recursion
