#include "core/actuation/actuators.h"

#include "core/actuation/side_by_side.h"
#include "core/actuation/small_product.h"

#include <algorithm>

namespace ffrobot {

using Eigen::Index;

void TrajectoryForces::act(ActuationSource &source, ExternalForces &forward) {
  const auto &force = source.trajectory_force();
  std::copy_n(force.data(), force.size(), forward.drive.begin() + static_cast<std::ptrdiff_t>(first_drive_));
}

void Motors::act(ActuationSource &source, ExternalForces &forward) {
  const auto &tau = source.tau();
  for (Index i = 0; i < tau.size(); ++i)
    forward.drive[first_drive_ + static_cast<std::size_t>(i)] = std::clamp(tau[i], -limit_[i], limit_[i]);
}

void Patches::act(ActuationSource &source, ExternalForces &forward) {
  forward.has_modal = true;
  collect(source.modal_force(), body_, force_);
  const Eigen::VectorXd &V = allocation_.solve(force_);
  multiply_small(allocation_.Phi(), V.data(), force_.data());
  distribute(force_, body_, forward.modal);
}

void PointForces::act(ActuationSource &source, ExternalForces &forward) {
  const auto [q, Q_a] = source.on_body(body_);
  const double theta = q[2];
  points_.solve(theta, q.tail(q.size() - 3), Q_a);
  for (Index k = 0; k < points_.count(); ++k) {
    const Eigen::Vector2d force = points_.global_force(theta, k);
    const std::size_t drive = first_drive_ + 2 * static_cast<std::size_t>(k);
    forward.drive[drive] = force.x();
    forward.drive[drive + 1] = force.y();
  }
}

void Actuation::apply(double t, ExternalForces &forward) {
  source_->evaluate(t);
  for (const auto &actuator : actuators_)
    actuator->act(*source_, forward);
}

} // namespace ffrobot
