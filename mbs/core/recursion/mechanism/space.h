// The plane and space as the recursion sees them: vectors A = (a, alpha) and forces (f, moment) of `dim` numbers, the
// first `linear` of them along axes that turn.
#pragma once

#include "core/recursion/joint/joints.h"
#include "core/recursion/planar/body.h"
#include "core/recursion/spatial/port.h"

namespace ffrobot::recursion {

// A rotation of axes; X is a number, or a Pack of what columns do.
template <class T> struct PlanarTurn {
  T c, s;
  template <class X> FFROBOT_INLINE void apply(const X *x, X *y) const {
    const X u = c * x[0] - s * x[1], v = s * x[0] + c * x[1];
    y[0] = u, y[1] = v, y[2] = x[2];
  }
  template <class X> FFROBOT_INLINE void back(const X *x, X *y) const {
    const X u = c * x[0] + s * x[1], v = c * x[1] - s * x[0];
    y[0] = u, y[1] = v, y[2] = x[2];
  }
  // A force at r from the origin has a moment about it
  template <class X> FFROBOT_INLINE static void add_moment(const T *r, X *f) { f[2] += r[0] * f[1] - r[1] * f[0]; }
  // Acceleration at r from the origin, but for what velocities do to it
  FFROBOT_INLINE static void shift(const T *r, T *A) { A[0] -= r[1] * A[2], A[1] += r[0] * A[2]; }
};

template <class T> struct SpatialTurn {
  T R[3][3];
  template <class X> FFROBOT_INLINE void apply(const X *x, X *y) const { turn(R, x, y), turn(R, x + 3, y + 3); }
  template <class X> FFROBOT_INLINE void back(const X *x, X *y) const {
    turn_back(R, x, y), turn_back(R, x + 3, y + 3);
  }
  template <class X> FFROBOT_INLINE static void add_moment(const T *r, X *f) {
    f[3] += r[1] * f[2] - r[2] * f[1];
    f[4] += r[2] * f[0] - r[0] * f[2];
    f[5] += r[0] * f[1] - r[1] * f[0];
  }
  FFROBOT_INLINE static void shift(const T *r, T *A) {
    A[0] += A[4] * r[2] - A[5] * r[1];
    A[1] += A[5] * r[0] - A[3] * r[2];
    A[2] += A[3] * r[1] - A[4] * r[0];
  }
};

struct Planar {
  static constexpr int dim = 3, linear = 2, axis = 2; // component that revolute joints leave free
  using Data = PlanarData;
  using Marker = PlanarMarker;
  using Body = planar::Body;
  using Vector = Vector2d;
  template <class T> using State = planar::State<T>;
  template <class T> using Turn = PlanarTurn<T>;
  static JointShape shape(JointKind kind) { return planar_shape(kind); }
};

struct Spatial {
  static constexpr int dim = 6, linear = 3, axis = 5;
  using Data = SpatialData;
  using Marker = SpatialMarker;
  using Body = spatial::Body;
  using Vector = Vector3d;
  template <class T> using State = spatial::State<T>;
  template <class T> using Turn = SpatialTurn<T>;
  static JointShape shape(JointKind kind) { return spatial_shape(kind); }
};

} // namespace ffrobot::recursion
