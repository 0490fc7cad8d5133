// Four doubles side by side, as one vector register of the processor holds them.
#pragma once

#include <Eigen/Core>

#include <cstring>

namespace ffrobot {

constexpr Eigen::Index lane_count = 4;

using Lanes = double __attribute__((vector_size(lane_count * sizeof(double))));

inline Lanes load(const double *x) {
  Lanes v;
  std::memcpy(&v, x, sizeof v);
  return v;
}

inline void store(double *x, Lanes v) { std::memcpy(x, &v, sizeof v); }

inline double sum(Lanes v) { return (v[0] + v[2]) + (v[1] + v[3]); }

// (y, x) of each pair (x, y)
inline Lanes swap_pairs(Lanes v) { return __builtin_shufflevector(v, v, 1, 0, 3, 2); }

inline Eigen::Index padded(Eigen::Index rows) { return (rows + lane_count - 1) / lane_count * lane_count; }

} // namespace ffrobot
