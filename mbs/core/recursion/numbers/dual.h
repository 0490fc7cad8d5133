// A number with its derivatives in eight directions.
#pragma once

#include "core/recursion/numbers/small.h"

namespace ffrobot::recursion {

struct Dual {
  static constexpr int directions = 8;
  double value;
  Eight rate;

  Dual() = default;
  FFROBOT_INLINE Dual(double x) : value(x), rate(Eight::zero()) {}
  FFROBOT_INLINE Dual(double x, const Eight &x_rate) : value(x), rate(x_rate) {}

  FFROBOT_INLINE Dual &operator+=(const Dual &o) { return value += o.value, rate += o.rate, *this; }
  FFROBOT_INLINE Dual &operator-=(const Dual &o) { return value -= o.value, rate -= o.rate, *this; }
  FFROBOT_INLINE Dual &operator*=(const Dual &o) { return *this = *this * o; }
  FFROBOT_INLINE friend Dual operator-(const Dual &a) { return {-a.value, -a.rate}; }
  FFROBOT_INLINE friend Dual operator+(const Dual &a, const Dual &b) { return {a.value + b.value, a.rate + b.rate}; }
  FFROBOT_INLINE friend Dual operator-(const Dual &a, const Dual &b) { return {a.value - b.value, a.rate - b.rate}; }
  FFROBOT_INLINE friend Dual operator*(const Dual &a, const Dual &b) {
    return {a.value * b.value, b.value * a.rate + a.value * b.rate};
  }
  FFROBOT_INLINE friend Dual operator/(const Dual &a, const Dual &b) {
    const double inverse = 1 / b.value, quotient = a.value * inverse;
    return {quotient, inverse * (a.rate - quotient * b.rate)};
  }
  FFROBOT_INLINE friend Dual operator+(const Dual &a, double b) { return {a.value + b, a.rate}; }
  FFROBOT_INLINE friend Dual operator+(double a, const Dual &b) { return b + a; }
  FFROBOT_INLINE friend Dual operator-(const Dual &a, double b) { return {a.value - b, a.rate}; }
  FFROBOT_INLINE friend Dual operator-(double a, const Dual &b) { return {a - b.value, -b.rate}; }
  FFROBOT_INLINE friend Dual operator*(double a, const Dual &b) { return {a * b.value, a * b.rate}; }
  FFROBOT_INLINE friend Dual operator*(const Dual &a, double b) { return b * a; }
};

FFROBOT_INLINE double value_of(const Dual &x) { return x.value; }

FFROBOT_INLINE void sine_and_cosine(const Dual &x, Dual &s, Dual &c) {
  const double sine = std::sin(x.value), cosine = std::cos(x.value);
  s = {sine, cosine * x.rate}, c = {cosine, -sine * x.rate};
}

// Of a sum of squares: zero is taken to stay so.
FFROBOT_INLINE Dual sqrt(const Dual &x) {
  const double root = std::sqrt(x.value);
  return root > 0 ? Dual(root, (0.5 / root) * x.rate) : Dual(0.);
}

FFROBOT_INLINE Dual angle_of(const Dual &sine, const Dual &cosine) {
  const double s = sine.value, c = cosine.value;
  return {std::atan2(s, c), (1 / (s * s + c * c)) * (c * sine.rate - s * cosine.rate)};
}

FFROBOT_INLINE Dual angle_by_sine(const Dual &sine, const Dual &cosine) {
  if (!(sine.value > 1e-9))
    return Dual(1.);
  const double s = sine.value, c = cosine.value, angle = std::atan2(s, c);
  const Eight turning = (1 / (s * s + c * c)) * (c * sine.rate - s * cosine.rate);
  return Dual(angle, turning) / sine;
}

} // namespace ffrobot::recursion
