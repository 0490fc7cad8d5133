// Friction along a coordinate.
#pragma once

#include "core/fields.h"
#include <cmath>

namespace ffrobot {

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

} // namespace ffrobot
