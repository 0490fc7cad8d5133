// Joints at which loops are cut. They have no coordinate in the tree; what acts along theirs acts on the two sections,
// as a moment or force on the second one and its opposite on the first.
#pragma once

#include "core/recursion/mechanism/workspace.h"

namespace ffrobot::recursion {

// -(c v + tau_c tanh(v / v_s)) along a coordinate whose rate is v: viscous and Coulomb friction, the latter smooth
// about rest.
struct Friction {
  double viscous = 0; // N s/m, or N m s
  double coulomb = 0; // N, or N m
  double speed = 1;   // m/s, or rad/s

  double resistance(double rate) const { return viscous * rate + coulomb * std::tanh(rate / speed); }
  double slope(double rate) const { // of the resistance
    const double steady = std::cosh(rate / speed);
    return viscous + coulomb / (speed * steady * steady);
  }
  bool acts() const { return viscous != 0 || coulomb != 0; }

  FFROBOT_FIELDS(viscous, coulomb, speed);
};

// A coordinate of such a joint, of the section on which wrench b of the mechanism acts on that of wrench a: the turn
// about (rad), or the way along (m), an axis of a.
struct CutJoint {
  int a = 0, b = 0; // wrenches
  bool turns = true;
  Vector3d axis = Vector3d::UnitZ(); // in axes of section a
  Friction friction;

  FFROBOT_FIELDS(a, b, turns, axis, friction);
};

// Rates (cuts) rad/s, m/s
template <class Space, class T>
void cut_rates(const Placed<Space, T> &placed, const std::vector<CutJoint> &cuts, T *rate);

// Adds moments (N m) or forces (N) of `size` (cuts) along the coordinates to wrenches (wrenches, dim).
template <class Space, class T>
void add_along_cuts(const Placed<Space, T> &placed, const std::vector<CutJoint> &cuts, const T *size, T *wrench);

} // namespace ffrobot::recursion
