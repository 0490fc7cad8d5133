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

// The kinetic energy 1/2 J row_dot^2 of a rotor whose angle is the row; compliance = 1/J, 1/(kg m^2).
//
// M q_ddot + J d d^T q_ddot with the gradient d of the row is the multiplier mu = J d^T q_ddot of one more row, with
// -1/J on the diagonal: d^T q_ddot - mu/J = 0 beside M q_ddot + d mu = Q. C M^-1 C^T gets 1/J there and stays positive
// definite. Nothing holds such a row: as a constraint its value and rate are 0.
struct Rotor {
  Measure row;
  double compliance;
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
