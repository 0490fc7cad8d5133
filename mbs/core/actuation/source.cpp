#include "core/actuation/source.h"

namespace ffrobot {

ActuationSource::ActuationSource(const System &system, std::vector<bool> is_trajectory,
                                 std::optional<ActuatorForces> actuator_forces)
    : is_trajectory_(std::move(is_trajectory)), actuator_forces_(std::move(actuator_forces)) {
  for (const auto &body : system.bodies)
    modal_zero_.emplace_back(Eigen::VectorXd::Zero(body.modes()));
  modal_force_ = modal_zero_;
}

void ActuationSource::resolve() {
  if (!actuator_forces_)
    return;
  actuator_forces_->resolve(workspace());
  tau_ = actuator_forces_->tau();
  for (std::size_t b = 0; b < modal_force_.size(); ++b)
    modal_force_[b] = actuator_forces_->modal_force()[b] + shape_force()[b];
}

} // namespace ffrobot
