// What the tolerance of a run in joint coordinates bounds: errors relative to the largest so far of what is alike.
#pragma once

#include "core/recursion/workspace.h"

namespace ffrobot::recursion {

// Alike are all ways of joints, all their angles, each body's modes, the rates of each of these, and the multipliers of
// one joint or path that are forces, or moments. Errors e and states z are local coordinates
// (space/local_coordinates.h).
template <class Space> class MotionNorm {
public:
  explicit MotionNorm(const Mechanism<Space> &mechanism);

  double of_state(const double *e) const;

  // Keeps the multipliers of the last evaluation; then, of another at a state that an error has shifted, by how much
  // these differ.
  void observe(const Workspace<Space, double> &w);
  double of_observed(const Workspace<Space, double> &w);
  bool observes() const { return !multiplier_group_.empty(); }

  // Peaks grow by the state z, its rate and the multipliers observed there; w: as at the last evaluation.
  void take(const double *z, const double *z_dot, const Workspace<Space, double> &w);

private:
  void sizes_of_multipliers(const Eigen::VectorXd &values, std::vector<double> &size) const;

  const Mechanism<Space> &mechanism_;
  double length_ = 0;      // m, of a body
  std::vector<int> group_; // of each of 2 n_v entries of z; those of rates follow those of what they are of
  std::vector<double> pace_,
      frequency_; // 1/s: of each group, below which rates are small; of each entry of v, of modes
  std::vector<double> peak_;
  mutable std::vector<double> size_;
  std::vector<int> multiplier_group_; // of each row
  std::vector<double> per_force_;     // of each group of these: 1, or the length of moments
  std::vector<double> force_peak_, force_now_, force_error_;
  Eigen::VectorXd observed_, change_;
  double inertial_ = 0; // N, largest sum of mass times acceleration
};

} // namespace ffrobot::recursion
