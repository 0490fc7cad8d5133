// Forces of a known motion: the recursive Newton-Euler algorithm (R. Featherstone, Rigid Body Dynamics Algorithms,
// 2008, ch. 5) for bodies with modes, in the plane and in space. In the plane it shares nothing with the elimination
// that finds accelerations but the kinematics of a state, in space the inertia of each body as well.
#pragma once

#include "core/recursion/newton_euler/known_body.h"

namespace ffrobot::recursion {

template <class Space> class NewtonEuler {
public:
  // An acceleration less gravity, or a force with its moment about the point where it acts: as A and f of the space
  using Vector = std::array<double, Space::dim>;

  explicit NewtonEuler(const Mechanism<Space> &mechanism); // which must outlive this

  const Mechanism<Space> &mechanism() const { return mechanism_; }

  // What accelerations() leaves in `w` of a state, accelerations and multipliers aside. generalized (n_v) may be null.
  void prepare(const double *q, const double *v, const double *generalized, Workspace<Space, double> &w);

  // Outward: accelerations of frames and ports by those of coordinates, a (n_v), and the forces that bodies and rotors
  // take. `w` is that of a prepare() at this state (in the plane of an accelerations() as well), nothing else having
  // been done with it.
  void accelerate(const double *q, const double *a, const Workspace<Space, double> &w);
  void leave_frames(Workspace<Space, double> &w) const; // their accelerations, as accelerations() does

  // What acts beside joints: constraints by their multipliers, with -lambda (may be null), and wrenches (wrenches, dim;
  // may be null). `w` has kinematics, and frames where directions of constraints move.
  void load(const double *lambda, const double *wrench, const Workspace<Space, double> &w);

  // Inward: what joints do to their outer sections, so that the loads and what bodies take are balanced; or so that the
  // loads alone are.
  void transmit(const Workspace<Space, double> &w, bool with_inertia = true);

  // Inward: generalized forces Q (n_v) of the loads
  void project(const double *q, const Workspace<Space, double> &w, double *Q);

  // Inward, after accelerate() and load(): M a - Q (n_v), with Q of gravity, elasticity, damping, the loads, and the
  // generalized forces on modes of prepare(), not those along joints.
  void require(const double *q, const double *a, Workspace<Space, double> &w, double *f);

  // After accelerate(): generalized forces on the modes (n_v; zero elsewhere) by which these move as they do beside
  // gravity, elasticity and damping, so that forces on sections and actuators have to make up for them.
  void require_of_modes(const double *q, const double *a, Workspace<Space, double> &w, double *f);

  // Adds to Q (n_v) what a moment about z of the joint that carries node i, on its outer section and the opposite on
  // the inner one, does on the modes of both bodies.
  void add_joint_moment_on_modes(std::size_t i, double moment, const Workspace<Space, double> &w, double *Q) const;

  // After load(): what the loads do on node i alone, (dim + n): force and moment about the origin of its frame, in axes
  // of the body, then generalized forces on its modes.
  VectorXd on_body(std::size_t i, const Workspace<Space, double> &w) const;

  // Second derivative of the value of a constraint by these accelerations, and the size of the terms that cancel in it.
  struct ConstraintAcceleration {
    double value, size;
  };
  ConstraintAcceleration of_constraint(std::size_t row, const double *a, const Workspace<Space, double> &w) const;

  // After transmit(), of the joint of node i: force on the outer section, with its moment about the origin of that
  // section, in global axes
  Vector in_global_axes(std::size_t i, const Workspace<Space, double> &w) const;
  // The rate of angular momentum of the rotor in it, a moment in global axes
  const Vector &of_rotor(std::size_t i) const { return of_rotor_[i]; }
  // All that acts on a port, with its outboard subtree: about the origin of its section, axes of the undeformed one
  const Vector &on_port(std::size_t port) const { return with_joints_[port]; }

  // After accelerate(): acceleration less gravity of the section of a port, in axes of the undeformed one
  const Vector &of_port(std::size_t port) const { return ports_[port]; }

private:
  void residual_of_modes(std::size_t i, const double *q, const double *a, VectorXd &z, Workspace<Space, double> &w,
                         double *f);
  Vector along_joint(std::size_t i, const double *q, const Workspace<Space, double> &w) const;
  // What loads along the coordinates of joint i do to its outer section, in axes of the joint
  Vector loads_along_joint(std::size_t i) const;
  template <class Act> void on_constraints(std::size_t i, const Workspace<Space, double> &w, const Act &act) const;

  const Mechanism<Space> &mechanism_;
  std::vector<std::conditional_t<Space::dim == 3, planar::KnownBody, spatial::KnownBody>> bodies_;
  std::vector<Vector> ports_, on_ports_, with_joints_; // of all ports: accelerations; loads; the latter with subtrees
  std::vector<double> terms_;                          // of all ports: what modes accelerate by
  std::vector<Vector> frames_;                         // of bodies: accelerations, axes of the body
  std::vector<Vector> inertia_;                        // of bodies: (force, moment) at the frame, axes of the body
  std::vector<double> rotor_;                          // rate of spin of the rotor on the inner section, times inertia
  VectorXd on_coordinates_;                            // (n_v) what constraints that are joint coordinates do to these
  std::vector<Vector> of_joint_, at_section_;          // by nodes, in axes of the joint; of the inboard port
  std::vector<Vector> of_rotor_;
};

} // namespace ffrobot::recursion
