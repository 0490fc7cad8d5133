// Forces that stay as they were last set: those of the commands of a sampled controller.
#pragma once

#include "core/linear/small_product.h"
#include "core/recursion/spatial/section.h"

#include <Eigen/Dense>
#include <utility>

namespace ffrobot::recursion {

// On the modes p of one of its two bodies. The joint turns sections, whose angular velocity is that of the frame and
// A J_l(phi) Phi_r p_dot, phi = Phi_r p; the motor turns the frame alone. What the section's part of the moment would
// do is taken back: -m (J_l^T exp(phi) B z)^T Phi_r, and J_l(phi)^T exp(phi) = J_l(phi), the left Jacobian of SO(3).
struct FrameShare {
  int q = 0, v = 0;       // of the first mode
  Eigen::Matrix3Xd Phi_r; // (3, n) of the section
  Vector3d axis;          // B z: of the joint, in axes of the undeformed section

  // Adds the modal forces of a moment m (N m along the axis, on this body) at q to those along v.
  void add(double moment, const double *q_all, double *force) const {
    const auto n = Phi_r.cols();
    const Vector3d phi = Phi_r * Map<const VectorXd>(q_all + q, n), across = phi.cross(axis);
    double a, b, a_rate, b_rate;
    spatial::rotation_series(phi.squaredNorm(), a, b, a_rate, b_rate);
    const Vector3d turned = axis + a * across + b * phi.cross(across); // J_l(phi) axis
    Map<VectorXd>(force + v, n) -= moment * (Phi_r.transpose() * turned);
  }
};

class ZeroOrderHold {
public:
  // direction (n_v, inputs): generalized forces of a unit of each command
  explicit ZeroOrderHold(MatrixXd direction)
      : direction_(std::move(direction)), u_(VectorXd::Zero(direction_.cols())),
        force_(VectorXd::Zero(direction_.rows())) {}

  // What a motor on frames takes back on the modes of a body, per unit of its command.
  void add_frame_motor(Index input, FrameShare share) { shares_.emplace_back(input, std::move(share)); }

  const MatrixXd &direction() const { return direction_; }
  const std::vector<std::pair<Index, FrameShare>> &frame_motors() const { return shares_; }

  void hold(const VectorXd &u) {
    u_ = u;
    multiply_small(direction_, u_.data(), force_.data());
  }

  // Adds them at q to those along v.
  void add(const double *q, double *force) const {
    Map<VectorXd>(force, force_.size()) += force_;
    for (const auto &[input, share] : shares_)
      share.add(u_[input], q, force);
  }

private:
  MatrixXd direction_;
  std::vector<std::pair<Index, FrameShare>> shares_;
  VectorXd u_, force_;
};

} // namespace ffrobot::recursion
