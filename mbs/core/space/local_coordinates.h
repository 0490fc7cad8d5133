// Coordinates in which one-step methods are those of a vector space, whatever the configuration space.
//
// The local coordinates z (2 n_v) of a state y = (q, v) are the numbers in q as they are, rotation vectors that lead
// there from a centre, and v. A step starts at its centre, where rotation vectors are zero, and makes less than half a
// turn, beyond which a state says nothing of the way to it: every method keeps its order, and quaternions their norm
// (H. Munthe-Kaas, BIT 38, 1998; generalized-alpha becomes that of O. Bruels, A. Cardona and M. Arnold, Mech. Mach.
// Theory 48, 2012). With numbers alone z is y, and nothing is computed here.
#pragma once

#include "core/space/configuration_space.h"

#include <algorithm>

namespace ffrobot {

class LocalCoordinates {
public:
  explicit LocalCoordinates(const ConfigurationSpace &space);

  const ConfigurationSpace &space() const { return space_; }
  Index state_size() const { return space_.n_q() + space_.n_v(); } // of y
  Index size() const { return 2 * space_.n_v(); }                  // of z

  void set_centre(const double *y);

  // y of z; points to z itself where the space is flat, and else to what the next call overwrites
  const double *state(const double *z) const { return space_.is_flat() ? z : curved_state(z); }
  void from_state(const double *y, double *z) const;

  // Whether no rotation vector of z is half a turn or more: state() then says all of z.
  bool is_within_half_turns(const double *z) const;

  // Largest angular velocity (rad/s) among v (n_v) of rotations
  double fastest_rotation(const double *v) const;

  // The position part of z moved by h dq (n_v)
  void shift(double *z, double h, const double *dq) const;

  // The position part of z_dot (n_v) at z
  void rate(const double *z, double *z_dot) const {
    std::copy_n(z + space_.n_v(), space_.n_v(), z_dot);
    if (!space_.is_flat())
      rates_of_rotations(z, z_dot);
  }

  // Takes z for the centre, z and its rate along; false where the space is flat: nothing has changed
  bool recentre(double *z, double *z_dot);

private:
  const double *curved_state(const double *z) const;
  void rates_of_rotations(const double *z, double *z_dot) const;

  ConfigurationSpace space_;
  VectorXd centre_;        // q, with zeros for its numbers; empty where the space is flat
  mutable VectorXd state_; // y
};

} // namespace ffrobot
