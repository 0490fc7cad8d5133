#include "core/actuation/system_source.h"

#include "core/actuation/points.h"

#include <algorithm>

namespace ffrobot {

using Eigen::Index;

SystemSource::SystemSource(const System &system, std::vector<bool> is_trajectory,
                           std::optional<ActuatorForces> actuator_forces)
    : ActuationSource(system), system_(system), is_trajectory_(std::move(is_trajectory)),
      actuator_forces_(std::move(actuator_forces)), modal_zero_(modal_force_) {
  trajectory_force_ = Eigen::VectorXd::Zero(std::count(is_trajectory_.begin(), is_trajectory_.end(), true));
}

void SystemSource::resolve() {
  Index k = 0;
  for (std::size_t r = 0; r < is_trajectory_.size(); ++r)
    if (is_trajectory_[r])
      trajectory_force_[k++] = -workspace().lambda[static_cast<Index>(r)];
  if (!actuator_forces_)
    return;
  actuator_forces_->resolve(workspace());
  tau_ = actuator_forces_->tau();
  for (std::size_t b = 0; b < modal_force_.size(); ++b)
    modal_force_[b] = actuator_forces_->modal_force()[b] + shape_force()[b];
}

ActuationSource::OnBody SystemSource::on_body(std::size_t body) {
  OnBody found{q().segment(system_.first_coordinate[body], 3 + system_.bodies[body].modes()), {}};
  driving_force(
      system_, workspace(), [this](std::size_t r) { return is_trajectory_[r]; }, shape_force()[body], body, found.Q_a);
  return found;
}

} // namespace ffrobot
