// A force of the user's on a marker, which may depend on how the marker moves.
#pragma once

#include "core/constraint/measure.h"
#include "core/recursion/point_force.h"

namespace ffrobot {

struct StateForce {
  MarkerReference marker;
  StateFunction function;

  Eigen::Vector3d operator()(double t, const Eigen::Vector3d &position, const Eigen::Vector3d &rate) const {
    Eigen::Vector3d force = Eigen::Vector3d::Zero();
    function.call(t, position.data(), rate.data(), force.data());
    return force;
  }

  Eigen::Vector3d operator()(double t, const std::vector<PlanarBodyState> &bodies) const {
    const MarkerMotion &m = marker.motion(bodies);
    return (*this)(t, {m.position.x(), m.position.y(), m.angle}, {m.velocity.x(), m.velocity.y(), m.angular_velocity});
  }
};

} // namespace ffrobot
