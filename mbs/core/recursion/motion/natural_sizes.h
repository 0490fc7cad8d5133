// Lengths and a pace that belong to a mechanism: what its motion is compared with, in place of a meter and a second.
#pragma once

#include "core/recursion/mechanism/workspace.h"

namespace ffrobot::recursion {

// Whether the multiplier of a constraint is a moment: the constraint holds angles, not ways
template <class Space> bool is_moment(const Mechanism<Space> &mechanism, const Constraint &row);

template <class Space> class NaturalSizes {
public:
  explicit NaturalSizes(const Mechanism<Space> &mechanism);

  // The run will last `duration` s: no pace is slower than once in it. Before, gravity alone makes one.
  void plan(double duration);

  double length() const { return length_; } // m, of the longest body
  // m, of each body from its frame: to what it carries, or its radius of gyration where that is farther
  const std::vector<double> &reach() const { return reach_; }
  double pace() const { return pace_; }                           // 1/s, of a motion without vibrations
  double acceleration() const { return length_ * pace_ * pace_; } // m/s^2

  // What constraints (constraints) leave at q and v: values relative to lengths or radians and to the largest of q,
  // their rates to the largest of v and to the pace.
  double of_values(const VectorXd &value, const double *q) const;
  double of_rates(const VectorXd &rate, const double *v) const;

  // Gradients (constraints, n_v) in natural sizes of constraints and of v, the same in all units.
  MatrixXd of_gradients(const MatrixXd &gradients) const;
  const VectorXd &of_rows() const { return of_row_; } // (constraints), 1 over their sizes

private:
  double by_gravity_ = 0, pace_ = 1;
  double length_ = 0;
  std::vector<double> reach_;
  VectorXd of_row_, of_q_, of_v_; // (constraints), (n_q), (n_v): 1 over 1 rad, length_, of p sqrt(mass) times it
};

} // namespace ffrobot::recursion
