#include "core/actuation/actuators.h"

#include "core/actuation/side_by_side.h"

#include <algorithm>

namespace ffrobot {

using Eigen::Index;

void TrajectoryForces::act(const ActuationSource &source, Workspace &forward) {
  const auto &lambda = source.workspace().lambda;
  std::size_t drive = first_drive_;
  for (Index r = 0; r < static_cast<Index>(source.system().n_bilateral()); ++r)
    if (source.is_trajectory(static_cast<std::size_t>(r)))
      forward.external_drive[drive++] = -lambda[r];
}

void Motors::act(const ActuationSource &source, Workspace &forward) {
  const auto &tau = source.tau();
  for (Index i = 0; i < tau.size(); ++i)
    forward.external_drive[first_drive_ + static_cast<std::size_t>(i)] = std::clamp(tau[i], -limit_[i], limit_[i]);
}

void Patches::act(const ActuationSource &source, Workspace &forward) {
  forward.has_external_modal = true;
  collect(source.modal_force(), body_, force_);
  const Eigen::VectorXd &V = allocation_.solve(force_);
  force_.noalias() = allocation_.Phi() * V;
  distribute(force_, body_, forward.external_modal);
}

void PointForces::act(const ActuationSource &source, Workspace &forward) {
  const System &system = source.system();
  const Workspace &w = source.workspace();
  const auto &body = system.bodies[body_];
  driving_force(
      system, w, [&](std::size_t r) { return source.is_trajectory(r); }, source.shape_force()[body_], body_, Q_a_);
  const Index first = system.first_coordinate[body_];
  const double theta = source.q()[first + 2];
  points_.solve(theta, source.q().segment(first + 3, body.modes()), Q_a_);
  for (Index k = 0; k < points_.count(); ++k) {
    const Eigen::Vector2d force = points_.global_force(theta, k);
    const std::size_t drive = first_drive_ + 2 * static_cast<std::size_t>(k);
    forward.external_drive[drive] = force.x();
    forward.external_drive[drive + 1] = force.y();
  }
}

void Actuation::apply(double t, Workspace &forward) {
  source_->evaluate(t);
  for (const auto &actuator : actuators_)
    actuator->act(*source_, forward);
}

} // namespace ffrobot
