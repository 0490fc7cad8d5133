// What the tolerance of a run in joint coordinates bounds: errors relative to the largest so far of what is alike.
#pragma once

#include "core/recursion/motion/natural_sizes.h"

namespace ffrobot::recursion {

constexpr double small_twist = 1e-5; // rad, of a spring: rounding of angles is less than a part of 1e-10 of it

// Largest sizes so far, all that a norm remembers: by group of what is alike in states, and in forces; N.
struct NormPeaks {
  std::vector<double> state, force;
  double inertial = 0;

  FFROBOT_FIELDS(state, force, inertial);
};

// Alike are all ways of joints, all their angles, each body's modes, the rates of each of these, the multipliers of one
// joint or path that are forces, or moments, and so what one joint of the tree hands to the body that carries it, and
// to the ground where it has no child: those on the ground of chains follow from what is between bodies.
// Errors e and states z are local coordinates (space/local_coordinates.h).
template <class Space> class MotionNorm {
public:
  explicit MotionNorm(const Mechanism<Space> &mechanism);

  // The run will last `duration` s. Rates are slow, and accelerations small, beside the natural pace; these beside the
  // largest `acceleration` (m/s^2) on a path to come, too: where a run starts smoothly all is small at first.
  void plan(double duration, double acceleration);
  const NaturalSizes<Space> &sizes() const { return sizes_; }

  // Of a spring in front of which an inertia swings (N m/rad, kg m^2): moments and rates of a small twist are small,
  // too. At rest, where nothing else acts, they are rounding.
  void add_spring(double stiffness, double inertia);

  double of_state(const double *e) const;

  // of_state, and the accelerations that a change of rates is worth at `rate` (1/s).
  double of_change(const double *change, double rate) const;

  // Motors (moments, or forces) follow from multipliers, of which theirs may be a small difference: from here on they
  // are judged by their own size while that is small.
  void add_motors(const std::vector<bool> &are_moments);
  bool judges_motors() const; // the next observe() and of_observed() are to be given theirs

  // Keeps the forces of the last evaluation: multipliers, then those at ports; then, of another at a state that an
  // error has shifted, by how much these differ. `motors`: theirs there; null where they are not judged.
  void observe(const Workspace<Space, double> &w, const VectorXd *motors = nullptr);
  double of_observed(const Workspace<Space, double> &w, const VectorXd *motors = nullptr);
  bool observes() const { return !force_group_.empty(); }

  // Peaks grow by the state z, its rate and the forces observed there; w: as at the last evaluation. `applied` (n_v):
  // given generalized forces there; null: none.
  void take(const double *z, const double *z_dot, const double *applied, const Workspace<Space, double> &w);

  NormPeaks peaks() const { return {peak_, force_peak_, inertial_}; }
  void set_peaks(const NormPeaks &peaks); // throws std::invalid_argument where they are those of another mechanism

private:
  void group_states();
  void group_forces();
  void find_pace();
  void add_squares(const double *z) const;
  void forces(const Workspace<Space, double> &w, const VectorXd *motors, VectorXd &values) const;
  void take_accelerations(const Workspace<Space, double> &w);
  void sizes_of_forces(const VectorXd &values, std::vector<double> &size) const;
  struct Largest {
    double force, moment; // N, N m
  };
  Largest largest() const; // so far

  const Mechanism<Space> &mechanism_;
  NaturalSizes<Space> sizes_;
  double pace_of_springs_ = 0;                  // 1/s, what a small twist makes
  double of_paths_ = 0, slow_acceleration_ = 0; // m/s^2: of paths; smaller ones count like this one
  std::vector<int> group_; // of each of 2 n_v entries of z; those of rates follow those of what they are of
  struct Run {             // entries of v side by side of one group
    Index first, count;
    std::size_t group;
  };
  std::vector<Run> runs_;
  std::vector<double> pace_;   // 1/s, of each group: below it rates are small
  std::vector<double> radian_; // s, that a mode takes for one, by entries of v; 0 of all others
  std::vector<double> peak_;   // of each group: of what it is of, of rates, of accelerations
  mutable std::vector<double> size_;
  std::vector<double> by_forces_, by_given_, of_rates_; // as in take(), squared
  std::vector<std::size_t> carriers_;                   // of all ports: that carry a joint of the tree
  std::vector<std::size_t> alone_;                      // nodes whose forces on the ground are judged
  std::size_t motors_ = 0;                              // judged
  std::vector<int>
      force_group_; // of each constraint, of each component at these ports, and of these nodes, of each motor
  std::vector<char> is_moment_;  // of each group of these
  std::vector<double> leverage_; // of each: more than 1 of those from which other forces follow, or that stand alone
  std::vector<double> force_peak_, force_now_, force_error_;
  VectorXd observed_, change_;
  double of_springs_ = 0; // N m, moments below count like this one
  double inertial_ = 0;   // N, largest sum of mass times acceleration
};

// What motors must do in place of the forces of constraint equations that hold trajectories.
template <class Space> class MotorForces {
public:
  virtual ~MotorForces() = default;
  virtual std::vector<bool> are_moments() const = 0; // N m, else N
  // At q (n_q), of which w has the kinematics and the multipliers
  virtual const VectorXd &find(const double *q, const Workspace<Space, double> &w) = 0;
};

} // namespace ffrobot::recursion
