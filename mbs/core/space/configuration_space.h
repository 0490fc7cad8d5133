// The space of the coordinates q of a system: numbers, and orientations as unit quaternions.
#pragma once

#include "core/eigen.h"

#include <vector>

namespace ffrobot {

// Velocities v and increments dq have n_v <= n_q components: one for a number, and three for a quaternion (w, x, y, z;
// body axes to global ones), which are an angular velocity or a rotation vector in body axes. Vectors of positions,
// rates and accelerations of points are numbers: all coordinates of planar bodies are.
class ConfigurationSpace {
public:
  ConfigurationSpace() = default;
  // rotations: index in v of the first of the three components of each, ascending
  explicit ConfigurationSpace(Index n_v, const std::vector<Index> &rotations = {});

  Index n_q() const { return n_v_ + rotations_.size(); }
  Index n_v() const { return n_v_; }
  bool is_flat() const { return rotations_.empty(); } // numbers alone: n_q = n_v, increments are differences

  // out (n_q) = q (+) h v: where moving with v for a time h leads; h = 1 for an increment. `out` may be `q`.
  void integrate(const double *q, double h, const double *v, double *out) const;

  // dq (n_v) with q1 = q0 (+) dq
  void difference(const double *q1, const double *q0, double *dq) const;

  struct Rotation {
    Index q, v; // its first components
  };
  struct Numbers {
    Index q, v, count;
  };
  const std::vector<Rotation> &rotations() const { return rotations_; }
  const std::vector<Numbers> &numbers() const { return numbers_; } // between the rotations

private:
  Index n_v_ = 0;
  std::vector<Rotation> rotations_;
  std::vector<Numbers> numbers_;
};

} // namespace ffrobot
