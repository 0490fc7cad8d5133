// What bodies and joints do to each other in a motion that is known: as outputs have it, state by state.
#pragma once

#include "core/recursion/newton_euler/newton_euler.h"

namespace ffrobot::recursion {

// A row for each state, global axes. Forces come with their moments about the origin of the section on which they act:
// (x, y, moment) in the plane, (x, y, z, mx, my, mz) in space.
struct MotionForces {
  RowMajor bodies;      // 9 of each: acceleration and angular acceleration of its data's origin, angular velocity
  RowMajor axes;        // 9 of each: of its data, row by row
  RowMajor points;      // 9 of each section on which a wrench may act: the same
  RowMajor sections;    // of each section of bodies where joints, constraints or wrenches are: all that acts there
  RowMajor joints;      // of each body: what its joint does to its outer section
  RowMajor constraints; // of each: on its section b
  RowMajor modal;       // (n_v) see NewtonEuler::require_of_modes
  RowMajor rotors;      // 3 of each body: rate of angular momentum of the rotor in its joint

  FFROBOT_FIELDS(bodies, axes, points, sections, joints, constraints, modal, rotors);
};

template <class Space> class ForcesOfStates {
public:
  ForcesOfStates(const Mechanism<Space> &mechanism, Index states); // the mechanism must outlive this

  // Row i, after prepare() without generalized forces, accelerate() and load() of lambda (constraints) and wrenches
  void write(Index i, const double *q, const double *a, const double *lambda, NewtonEuler<Space> &forces,
             Workspace<Space, double> &w);

  // Joints and constraints of row i: what lambda does by itself, after load() of it
  void write_loads(Index i, const double *lambda, NewtonEuler<Space> &forces, const Workspace<Space, double> &w);

  MotionForces &&found() { return std::move(found_); }

  // Of each column block of `sections`: body, and marker of its data
  static std::vector<std::array<int, 2>> sections(const Mechanism<Space> &mechanism);

private:
  void write_constraints(Index i, const double *lambda, const Workspace<Space, double> &w);
  void write_joints(Index i, const NewtonEuler<Space> &forces, const Workspace<Space, double> &w);
  void write_sections(Index i, const NewtonEuler<Space> &forces, const Workspace<Space, double> &w);
  void write_point(const Attachment &at, const NewtonEuler<Space> &forces, const Workspace<Space, double> &w,
                   double *to) const;

  const Mechanism<Space> &mechanism_;
  MotionForces found_;
};

} // namespace ffrobot::recursion
