// Equations and forces along measures: what holds, drives and connects bodies.
#pragma once

#include "core/constraint/measure.h"
#include "core/time_function/time_function.h"

#include <cmath>

namespace ffrobot {

// C = row - target(t) = 0 (m or rad): a bilateral constraint.
struct Constraint {
  Measure row;
  TimeFunction target;
};

// The kinetic energy 1/2 J row_dot^2 of a rotor whose angle is the row.
struct Rotor {
  Measure row;
  double inertia; // J, kg m^2
};

// -(c v + tau_c tanh(v / v_s)) along a row whose rate is v: viscous and Coulomb friction, the latter smooth about rest.
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
};

// Generalized force `magnitude(t)` (N along a length, N m about an angle) along a row: joint moments, point forces,
// with the same directions as constraints.
struct Drive {
  Measure row;
  TimeFunction magnitude;
  Friction friction = {};
};

// Spring and damper of a gear: the moment k delta + c delta_dot, delta = motor - joint, pulls the motor back and the
// joint along. Both rows are angles, which do not move with the bodies.
struct Spring {
  Measure motor, joint;
  double stiffness = 0; // N m/rad
  double damping = 0;   // N m s/rad

  double moment(const MeasureMotion &of_motor, const MeasureMotion &of_joint) const {
    return stiffness * (of_motor.value - of_joint.value) + damping * (of_motor.rate - of_joint.rate);
  }
};

} // namespace ffrobot
