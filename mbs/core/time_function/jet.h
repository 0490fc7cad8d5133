// Arithmetic of jets (time_function.h), and what instructions of expressions do to them.
#pragma once

#include "core/time_function/time_function.h"

#include <cmath>
#include <limits>

namespace ffrobot {

inline constexpr double nan = std::numeric_limits<double>::quiet_NaN();

template <class T> [[gnu::always_inline]] inline JetOf<T> operator+(const JetOf<T> &a, const JetOf<T> &b) {
  return {a.value + b.value, a.rate + b.rate, a.acceleration + b.acceleration};
}
template <class T> [[gnu::always_inline]] inline JetOf<T> operator-(const JetOf<T> &a, const JetOf<T> &b) {
  return {a.value - b.value, a.rate - b.rate, a.acceleration - b.acceleration};
}
template <class T> [[gnu::always_inline]] inline JetOf<T> operator-(const JetOf<T> &a) {
  return {-a.value, -a.rate, -a.acceleration};
}

template <class T> [[gnu::always_inline]] inline JetOf<T> operator*(const JetOf<T> &a, const JetOf<T> &b) {
  return {a.value * b.value, a.rate * b.value + a.value * b.rate,
          a.acceleration * b.value + 2.0 * a.rate * b.rate + a.value * b.acceleration};
}

/// Leibniz' rule on a = q b, solved for q.
template <class T> [[gnu::always_inline]] inline JetOf<T> operator/(const JetOf<T> &a, const JetOf<T> &b) {
  const T value = a.value / b.value;
  const T rate = (a.rate - value * b.rate) / b.value;
  return {value, rate, (a.acceleration - 2.0 * rate * b.rate - value * b.acceleration) / b.value};
}

/// Chain rule: f(u(t)) from f, df/du and d²f/du².
template <class T>
[[gnu::always_inline]] inline JetOf<T> chain(const JetOf<T> &u, const T &f, const T &df, const T &ddf) {
  return {f, df * u.rate, ddf * u.rate * u.rate + df * u.acceleration};
}

/// Of an instruction that takes a constant for an operand
template <class T> [[gnu::always_inline]] inline JetOf<T> apply_constant(Op op, const JetOf<T> &z, double constant) {
  switch (op) {
  case Op::add:
    return {z.value + constant, z.rate, z.acceleration};
  case Op::subtract:
    return {z.value - constant, z.rate, z.acceleration};
  case Op::multiply:
    return {z.value * constant, z.rate * constant, z.acceleration * constant};
  default:
    return {z.value / constant, z.rate / constant, z.acceleration / constant};
  }
}

inline Jet exp(const Jet &u) {
  const double f = std::exp(u.value);
  return chain(u, f, f, f);
}

inline Jet log(const Jet &u) {
  if (!(u.value > 0.0))
    return {nan, nan, nan};
  return chain(u, std::log(u.value), 1.0 / u.value, -1.0 / (u.value * u.value));
}

inline Jet sqrt(const Jet &u) {
  const double f = std::sqrt(u.value);
  return chain(u, f, 0.5 / f, -0.25 / (f * u.value));
}

inline Jet tan(const Jet &u) {
  const double f = std::tan(u.value);
  return chain(u, f, 1.0 + f * f, 2.0 * f * (1.0 + f * f));
}

inline Jet tanh(const Jet &u) {
  const double f = std::tanh(u.value);
  return chain(u, f, 1.0 - f * f, -2.0 * f * (1.0 - f * f));
}

inline Jet abs(const Jet &u) {
  // At a zero the first derivative that is not 0 tells the sign just after it.
  const double sign = u.value != 0.0 ? u.value : u.rate != 0.0 ? u.rate : u.acceleration;
  return sign < 0.0 ? -u : u;
}

/// u^n for a small integer n ≥ 2, by squaring: exact where the products are, and several times faster than pow.
template <class T> [[gnu::always_inline]] inline JetOf<T> integer_power(const JetOf<T> &u, int n) {
  T lower = T{} + 1.0; // uⁿ⁻²
  T square = u.value;
  for (int rest = n - 2; rest > 0; rest >>= 1, square *= square)
    if (rest & 1)
      lower *= square;
  return chain<T>(u, lower * u.value * u.value, n * lower * u.value, n * (n - 1) * lower);
}
inline bool is_small_integer(double n) { return n >= 2.0 && n <= 16.0 && n == std::floor(n); }

inline Jet power(const Jet &u, const Jet &exponent) {
  if (exponent.rate != 0.0 || exponent.acceleration != 0.0)
    return exp(exponent * log(u));
  const double n = exponent.value;
  if (n == 0.0)
    return {1.0, 0.0, 0.0};
  if (n == 1.0)
    return u;
  if (is_small_integer(n))
    return integer_power(u, static_cast<int>(n));
  return chain(u, std::pow(u.value, n), n * std::pow(u.value, n - 1.0), n * (n - 1.0) * std::pow(u.value, n - 2.0));
}

inline double finite_or_nan(double x) { return std::isfinite(x) ? x : nan; }
inline Jet finite_or_nan(const Jet &jet) {
  return {finite_or_nan(jet.value), finite_or_nan(jet.rate), finite_or_nan(jet.acceleration)};
}

// 1 where it holds, else 0; NaN where an operand is
template <class T, class Mask>
[[gnu::always_inline]] inline JetOf<T> truth(const Mask &holds, const JetOf<T> &a, const JetOf<T> &b) {
  const T none = T{} + nan, zero{};
  const auto is_known = (a.value == a.value) & (b.value == b.value);
  const T rate = is_known ? zero : none;
  return {is_known ? (holds ? zero + 1.0 : zero) : none, rate, rate};
}

template <class T>
[[gnu::always_inline]] inline JetOf<T> select(const JetOf<T> &condition, const JetOf<T> &a, const JetOf<T> &b) {
  const auto chosen = condition.value != 0.0, is_known = condition.value == condition.value;
  const auto of = [&](const T &x, const T &y) { return is_known ? (chosen ? x : y) : condition.value; };
  return {of(a.value, b.value), of(a.rate, b.rate), of(a.acceleration, b.acceleration)};
}

// Of arithmetic, comparisons and logic, which take numbers side by side, too: operands are z, x and z, or x, y and z
template <class T>
[[gnu::always_inline]] inline JetOf<T> apply_simple(Op op, const JetOf<T> &x, const JetOf<T> &y, const JetOf<T> &z) {
  switch (op) {
  case Op::add:
    return x + z;
  case Op::subtract:
    return x - z;
  case Op::multiply:
    return x * z;
  case Op::divide:
    return x / z;
  case Op::negate:
    return -z;
  case Op::less:
    return truth(x.value < z.value, x, z);
  case Op::less_equal:
    return truth(x.value <= z.value, x, z);
  case Op::greater:
    return truth(x.value > z.value, x, z);
  case Op::greater_equal:
    return truth(x.value >= z.value, x, z);
  case Op::logical_and:
    return truth((x.value != 0.0) & (z.value != 0.0), x, z);
  case Op::logical_or:
    return truth((x.value != 0.0) | (z.value != 0.0), x, z);
  case Op::logical_not:
    return truth(z.value == 0.0, z, z);
  default:
    return select(x, y, z);
  }
}

// Of any instruction, with the same operands
[[gnu::always_inline]] inline Jet apply(const Expression::Instruction &i, const Jet &x, const Jet &y, const Jet &z) {
  if (i.takes_constant)
    return apply_constant(i.op, z, i.constant);
  switch (i.op) {
  case Op::constant:
  case Op::time:
    return {i.constant, 0.0, 0.0};
  case Op::power:
    return power(x, z);
  case Op::sin:
    return chain(z, std::sin(z.value), std::cos(z.value), -std::sin(z.value));
  case Op::cos:
    return chain(z, std::cos(z.value), -std::sin(z.value), -std::cos(z.value));
  case Op::tan:
    return tan(z);
  case Op::exp:
    return exp(z);
  case Op::log:
    return log(z);
  case Op::sqrt:
    return sqrt(z);
  case Op::abs:
    return abs(z);
  case Op::tanh:
    return tanh(z);
  default:
    return apply_simple(i.op, x, y, z);
  }
}

} // namespace ffrobot
