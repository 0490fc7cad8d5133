// What changes from evaluation to evaluation. Nothing is allocated after construction.
#pragma once

#include "core/recursion/mechanism/mechanism.h"
#include "core/recursion/mechanism/orientation.h"

namespace ffrobot::recursion {

// Columns side by side: 0 is what acts without constraints, column r what a unit of multiplier r does. Sizes that are
// compiled (of a point in the plane, with a driven joint, and in space); where there are fewer constraint equations the
// rest is zero. More equations go in blocks (blocks.h).
template <class Space> constexpr int column_counts[] = {1, Space::linear + 1, 4, 7, 16};
constexpr int most_columns = 16;
constexpr int block_constraints = most_columns - 1;

// What sums of a_i b_i^T are made of, columns of block after block
template <class T> struct Terms {
  using Columns = Pack<T, most_columns>;
  Aligned<T> a, b; // (terms, most_columns); they grow in the first evaluation alone
  FFROBOT_NOINLINE void add(const Columns &a_i, const Columns &b_i) {
    const std::size_t end = a.size();
    a.resize(end + most_columns, T(0.)), b.resize(end + most_columns, T(0.));
    a_i.write(a.data() + end), b_i.write(b.data() + end);
  }
  void clear() { a.clear(), b.clear(); }
};

// A part of many constraint equations
template <class T> struct Block {
  std::vector<int> equations;
  Terms<T> terms;
  Aligned<T> stored, bias; // of the workspace, their columns
};

// A joint, in axes of the outer section
template <class Space, class T> struct Hinge {
  static constexpr int d = Space::dim;
  typename Space::template Turn<T> turn;              // to axes of the inboard port
  T cross_cosine, cross_sine;                         // of a universal joint's second angle
  T r[Space::linear] = {}, r_dot[Space::linear] = {}; // origin of the section from the port's, and its rate
  T c[d] = {};                                        // acceleration by velocities
  Pack<T, d> Lambda[d] = {};                          // what the port feels: f = Lambda A + bias
  T column[d][packed<T, d>] = {};                     // force of 1 along each axis of the section, in axes of the port
  Pack<T, d> U[d] = {};                               // by freedoms, the last eliminated first
  T D_inverse[d];
  T A[packed<T, d>] = {}; // of the section
  T pin[2];               // U/D of a pin, in place of all that
  T f[packed<T, d>] = {}; // on the ground, in axes of the section, of a body that is alone
  T spin;                 // rad/s of its rotor about z
  int row[d];             // of each freedom: the active constraint equation that is its coordinate; -1: none
  T gyro[2]; // moment on the inner section about x, y by which the rotor resists turning with it, opposite sign
};

template <class Space, class T> struct PortWork {
  static constexpr int d = Space::dim;
  Pack<T, d> X[d], G[d], Y[d]; // A_port = X A + beta + G f; f = -Y (X A + …) - …
  T beta[d];
  T A[d];                 // axes of the undeformed section
  T f[packed<T, d>] = {}; // on the body, by its child and by constraints; where modes move the port
  // of a port in the plane that passes forces only
  T Lambda_xx, Lambda_xy, Lambda_yy, Y_xx, Y_xy, Y_yy, X_xa, X_ya, beta_x, beta_y;
};

// Motion of a frame or of a section, global axes; in the plane with a third axis
template <class T> struct Pose {
  T r[3], v[3], omega[3]; // position, velocity, angular velocity
  T R[3][3];              // its axes
  T angle;                // in the plane, full turns counted
};

template <class Space, class T> struct Workspace {
  static constexpr int d = Space::dim;
  explicit Workspace(const Mechanism<Space> &m); // which must outlive this

  const Mechanism<Space> &m;
  int columns; // one of column_counts
  std::vector<typename Space::template State<T>> bodies;
  std::vector<Hinge<Space, T>> hinges;
  Aligned<PortWork<Space, T>> ports;
  Aligned<Pack<T, d>> cross; // (crosses, d): G between ports
  Aligned<Pack<T, d>> soft;  // (nodes with an inboard port, 2 d): M^-1 X^T, and M^-1
  std::vector<int> first_soft;
  Aligned<T> force;             // (ports, d, columns) on ports, with opposite sign: bias of the child subtree
  Aligned<T> bias;              // (ports, d, columns) beta of ports, by columns; of bodies with several
  Aligned<T> stored;            // (slots, columns) of which the third pass takes sums: D^-1 u of joints, forces
  Aligned<T> sine, cosine;      // (nodes) of frames in the plane; of revolute joints in space
  Aligned<T> z;                 // of the widest body
  Aligned<T> delassus;          // (constraints)^2 C M^-1 C^T of active ones
  bool keeps_delassus = false;  // asked for
  Aligned<T> factor;            // factored()^2, L and 1/D of it
  std::vector<int> active;      // constraint equations that are kept; others depend on them
  std::vector<int> column;      // of each of these; 0: not kept, or not in the block at hand
  Aligned<T> point_force;       // (actions, linear, columns) of constraints of constant direction, on ports
  Aligned<T> lift;              // (columns) what active ones of that kind measure of gravity, from 0 on
  std::vector<Block<T>> blocks; // of active ones where they are more than columns; else none
  Aligned<T> lambda;            // (constraints)
  const T *target = nullptr;    // (constraints) that prescribed coordinates follow in the acceleration pass; null: none
  Aligned<T> nothing;           // (constraints) zeros
  Aligned<T> y;                 // (columns, or 1 + constraints): 1, multipliers of active ones
  std::vector<Pose<T>> frames;  // of nodes
  std::vector<Turning> turning; // of ground markers, in space: those that turn are to be kept up to date
  unsigned long evaluations = 0;

  // A force of a constraint on a port, of constant direction: where it is in point_force
  struct PointForce {
    std::size_t place;
    int constraint;
    double force[Space::linear];
  };
  std::vector<PointForce> point_forces;
  std::vector<double> lifts;                    // (constraints)
  std::vector<std::pair<int, int>> coordinates; // (constraints) node and freedom of those that are a coordinate, or -1

  void keep(std::vector<int> equations); // these alone
  void put_in_columns();                 // point_force and lift, after a change of `column`
  int factored() const { return blocks.empty() ? columns - 1 : static_cast<int>(active.size()); }
};

// Forces beside gravity, elasticity and damping
template <class T> struct Forces {
  const T *generalized = nullptr; // (n_v): of joints and on modes
  const T *wrench = nullptr;      // (wrenches, dim): force and moment on each, global axes
};

// A state under generalized forces (as in Forces; may be null) whose kinematics the workspace has, with frames in
// w.frames. Whatever asks where sections are takes one of these; it holds until w is used for another state.
template <class Space, class T> struct Placed {
  Workspace<Space, T> &w;
  const T *q, *v, *generalized;
};

// The first pass, outward: kinematics, and where all frames are.
template <class Space, class T>
Placed<Space, T> place_all(const T *q, const T *v, const std::type_identity_t<T> *generalized, Workspace<Space, T> &w);

// The second pass, inward, and the third, outward: accelerations a (n_v) under wrenches (as in Forces; may be null),
// and multipliers w.lambda of constraint equations whose second time derivative is to be `target` (constraints).
template <class Space, class T>
void accelerations(const Placed<Space, T> &at, const std::type_identity_t<T> *wrench, const T *target, T *a);

// All three
template <class Space, class T>
void accelerations(const T *q, const T *v, const Forces<T> &forces, const T *target, Workspace<Space, T> &w, T *a);

// What multipliers (constraints) do to a system at rest: dq (n_v) = -M^-1 C^T lambda, those of active equations, with
// the columns of the last accelerations(), to whose state q is near. Motions and forces at ports in `w` are those of dq
// afterwards.
template <class Space, class T> void respond(const T *q, const T *lambda, Workspace<Space, T> &w, T *dq);

// The same with the multipliers that answer a residual: dq = -M^-1 C^T (C M^-1 C^T)^-1 residual (constraints).
template <class Space, class T> void response(const T *q, const T *residual, Workspace<Space, T> &w, T *dq);

// What rounding of every part by `relative` leaves in the sums that the last accelerations() were: of what acts and of
// what each multiplier does, which may cancel. To its state q is near; `w` afterwards as after respond().
template <class Space, class T>
void round_off(const T *q, const std::type_identity_t<T> &relative, Workspace<Space, T> &w, T *dq);

// Values and rates of all constraint equations (m, rad; m/s, rad/s), at a state without generalized forces.
template <class Space, class T>
Placed<Space, T> measure(const T *q, const T *v, Workspace<Space, T> &w, T *value, T *rate);

} // namespace ffrobot::recursion
