// Exact derivatives of the equations of motion of one body and of its markers' accelerations.
#pragma once

#include "core/body/planar_body.h"

#include <Eigen/Core>

namespace ffrobot {

// M, D, K of one body (its block of the system's), without applied loads. After kinematics.
void tangent(const PlanarBody &body, const PlanarBodyState &state, const double *q, const double *v, const double *a,
             const Eigen::Vector2d &gravity, Eigen::Ref<Eigen::MatrixXd> M, Eigen::Ref<Eigen::MatrixXd> D,
             Eigen::Ref<Eigen::MatrixXd> K);

// K += d2(wrench . (x, y, angle) of marker k)/dq2 of one body, the wrench in global axes and fixed.
void add_marker_curvature(const PlanarBody &body, const PlanarBodyState &state, Eigen::Index k,
                          const Eigen::Vector3d &wrench, Eigen::Ref<Eigen::MatrixXd> K);

// Derivatives (3, coordinates of the body) of the acceleration (x, y, angular) of a marker, as
// RowTangents (system/tangent.h).
struct MarkerTangent {
  Eigen::Matrix3Xd by_acceleration, by_velocity, by_position;
};
void marker_tangent(const PlanarBody &body, const PlanarBodyState &state, Eigen::Index k, const double *v,
                    const double *a, MarkerTangent &result);

} // namespace ffrobot
