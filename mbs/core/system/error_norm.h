// What the tolerance of a run bounds: errors relative to the largest of what has been reported so far.
#pragma once

#include "core/system/system.h"

#include <vector>

namespace ffrobot {

// Largest sizes of one body's motion so far. Modal: |p| and its rates, mass-orthonormal coordinates (m sqrt(kg), …).
struct BodyPeaks {
  double velocity = 0, angular_velocity = 0, modal_velocity = 0; // m/s, rad/s
  double modal = 0;
  double acceleration = 0, angular_acceleration = 0, modal_acceleration = 0; // m/s^2, rad/s^2
};

struct Peaks {
  std::vector<BodyPeaks> bodies;
  Eigen::VectorXd groups; // (groups) of what is judged together
};

// Forces of motors that stand for multipliers in what is reported (see actuator_forces.h): linear in these.
class ForcesOfMotors {
public:
  virtual ~ForcesOfMotors() = default;
  virtual const std::vector<Measure> &motors() const = 0; // that they act along
  // (motors) for multipliers lambda, at the coordinates of the last evaluation
  virtual const Eigen::VectorXd &tau_of(const Eigen::VectorXd &lambda, const Workspace &w) = 0;
};

// What is judged besides coordinates and velocities.
struct Judged {
  // group[i]: constraints whose multipliers are judged together (the force of a joint, the moment of a joint …);
  // moment[i]: whether constraint i carries a moment.
  std::vector<int> group;
  std::vector<bool> moment;
  std::vector<Measure> joints;      // whose rates are: small differences of large ones
  ForcesOfMotors *motors = nullptr; // whose moments are, likewise; may be null, must outlive the norm
};

// Errors e and states z are local coordinates (see local_coordinates.h): positions, then velocities.
class ErrorNorm {
public:
  ErrorNorm(const System &system, Judged judged);

  // Floors of what errors are compared with follow from the motion itself, not from a second and a meter: a robot that
  // takes an hour for its path gets it as precise as one that takes a second.
  void plan(double duration);

  double of_state(const double *z, const double *e) const;

  // of_state, and the accelerations that a change of velocity is worth at `rate` (1/s).
  double of_change(const double *z, const double *change, double rate) const;

  // Multipliers, rates of joints and, where they are small, moments of motors at the last evaluation.
  void observe(const Workspace &w, Eigen::VectorXd &values);

  // Of what the evaluation w, at a state that an error has shifted, changes of the values observed last; NaN where it
  // is not finite.
  double of_observed(const Eigen::VectorXd &values, const Workspace &w);
  bool observes() const { return !group_.empty(); }

  // Peaks grow by the state z, its rate and what is observed there; w: loads as at the last evaluation.
  void take(const double *z, const double *z_dot, const Eigen::VectorXd &observed, const Workspace &w);

  const Peaks &peaks() const { return peaks_; }
  void set_peaks(Peaks peaks) { peaks_ = std::move(peaks); }

  double fastest() const; // 1/s: highest frequency of the motion

private:
  Eigen::VectorXd applied_modal_force(std::size_t b, const Workspace &w) const;
  double largest_force() const;
  bool has_small_moments() const;
  void rates_of_joints(const Workspace &w, Eigen::VectorXd &values) const;
  void measure_groups(const Eigen::VectorXd &values, Eigen::VectorXd &size) const;

  const System &system_;
  std::vector<Measure> joints_;
  ForcesOfMotors *motors_;
  Eigen::Index multipliers_;      // that are judged
  std::size_t multiplier_groups_; // come first
  std::vector<int> group_;        // of each value
  std::vector<double> per_force_; // of each group, its size that a force of size 1 is compared with; 0: of rates
  double rate_ = 1;               // 1/s: rates far below it do not count
  std::vector<Eigen::VectorXd> frequency_; // of each body's modes, rad/s
  Peaks peaks_;
  Eigen::VectorXd group_now_, group_error_, change_, applied_, vibration_;
};

} // namespace ffrobot
