// Four doubles side by side, as one vector register of the processor holds them, or two.
#pragma once

#include <Eigen/Core>

#include <cstring>

namespace ffrobot {

constexpr Eigen::Index lane_count = 4;

#ifdef __AVX__
using Lanes = double __attribute__((vector_size(lane_count * sizeof(double))));
#else
// Two registers of half the size, by hand: compilers take vectors that are longer than a register apart in memory.
struct Lanes {
  using Half = double __attribute__((vector_size(lane_count / 2 * sizeof(double))));
  Half low, high;

  double operator[](int i) const { return i < 2 ? low[i] : high[i - 2]; }
  Lanes &operator+=(Lanes b) { return *this = *this + b; }
  friend Lanes operator+(Lanes a, Lanes b) { return {a.low + b.low, a.high + b.high}; }
  friend Lanes operator-(Lanes a, Lanes b) { return {a.low - b.low, a.high - b.high}; }
  friend Lanes operator*(Lanes a, Lanes b) { return {a.low * b.low, a.high * b.high}; }
  friend Lanes operator+(Lanes a, double b) { return {a.low + b, a.high + b}; }
  friend Lanes operator*(Lanes a, double b) { return {a.low * b, a.high * b}; }
  friend Lanes operator*(double a, Lanes b) { return b * a; }
};
#endif

inline Lanes load(const double *x) {
  Lanes v;
  std::memcpy(&v, x, sizeof v);
  return v;
}

inline void store(double *x, Lanes v) { std::memcpy(x, &v, sizeof v); }

inline double sum(Lanes v) { return (v[0] + v[2]) + (v[1] + v[3]); }

// (y, x) of each pair (x, y)
#ifdef __AVX__
inline Lanes swap_pairs(Lanes v) { return __builtin_shufflevector(v, v, 1, 0, 3, 2); }
#else
inline Lanes swap_pairs(Lanes v) {
  return {__builtin_shufflevector(v.low, v.low, 1, 0), __builtin_shufflevector(v.high, v.high, 1, 0)};
}
#endif

inline Eigen::Index padded(Eigen::Index rows) { return (rows + lane_count - 1) / lane_count * lane_count; }

} // namespace ffrobot
