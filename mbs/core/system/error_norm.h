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
  Eigen::VectorXd groups; // (groups) N or N m, of the multipliers judged together
};

// Errors e and states z are local coordinates (see local_coordinates.h): positions, then velocities.
class ErrorNorm {
public:
  // group[i]: constraints whose multipliers are judged together (the force of a joint, the moment of a joint …);
  // moment[i]: whether constraint i carries a moment. Both empty: multipliers are not judged.
  ErrorNorm(const System &system, std::vector<int> group, const std::vector<bool> &moment);

  // Floors of what errors are compared with follow from the motion itself, not from a second and a meter: a robot that
  // takes an hour for its path gets it as precise as one that takes a second.
  void plan(double duration);

  double of_state(const double *z, const double *e) const;

  // of_state, and the accelerations that a change of velocity is worth at `rate` (1/s).
  double of_change(const double *z, const double *change, double rate) const;

  // Of multipliers lambda that an error changes to `shifted`; NaN where they are not finite.
  double of_multipliers(const Eigen::VectorXd &lambda, const Eigen::VectorXd &shifted);
  bool judges_multipliers() const { return !group_.empty(); }

  // Peaks grow by the state z, its rate and the multipliers there; w: loads as at the last evaluation.
  void take(const double *z, const double *z_dot, const Eigen::VectorXd &lambda, const Workspace &w);

  const Peaks &peaks() const { return peaks_; }
  void set_peaks(Peaks peaks) { peaks_ = std::move(peaks); }

  double fastest() const; // 1/s: highest frequency of the motion

private:
  Eigen::VectorXd applied_modal_force(std::size_t b, const Workspace &w) const;
  void measure_groups(const Eigen::VectorXd &lambda, Eigen::VectorXd &size) const;

  const System &system_;
  std::vector<int> group_;
  std::vector<bool> group_is_moment_;
  double rate_ = 1;                        // 1/s: rates far below it do not count
  std::vector<Eigen::VectorXd> frequency_; // of each body's modes, rad/s
  Peaks peaks_;
  Eigen::VectorXd group_now_, group_error_, applied_;
};

} // namespace ffrobot
