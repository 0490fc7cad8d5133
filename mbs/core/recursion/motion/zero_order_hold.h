// Forces that stay as they were last set: those of the commands of a sampled controller.
#pragma once

#include "core/linear/small_product.h"
#include "core/recursion/motion/frame_motor.h"

#include <utility>
#include <vector>

namespace ffrobot::recursion {

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
