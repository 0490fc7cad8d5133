#include "core/analysis/replay.h"

#include "core/actuation/points.h"

#include <algorithm>

namespace ffrobot {

using Eigen::Index;
using Eigen::VectorXd;

RecordedActuation::RecordedActuation(const System &system, const Recording &recording, std::vector<bool> is_trajectory,
                                     std::optional<ActuatorForces> actuator_forces)
    : ActuationSource(system), system_(system), is_trajectory_(std::move(is_trajectory)),
      actuator_forces_(std::move(actuator_forces)), motion_(system), recorded_(motion_, recording), workspace_(system),
      a_(system.n_v()) {
  trajectory_force_ = VectorXd::Zero(std::count(is_trajectory_.begin(), is_trajectory_.end(), true));
  motion_.norm().plan(recording.times.back() - recording.times.front());
}

void RecordedActuation::find(double t) {
  const double *y = recorded_.state(t);
  accelerations(system_, t, y, y + system_.n_q(), workspace_, a_.data());
  q_ = Eigen::Map<const VectorXd>(y, system_.n_q());
  Index k = 0;
  for (std::size_t r = 0; r < is_trajectory_.size(); ++r)
    if (is_trajectory_[r])
      trajectory_force_[k++] = -workspace_.lambda[static_cast<Index>(r)];
  if (!actuator_forces_)
    return;
  actuator_forces_->resolve(workspace_);
  tau_ = actuator_forces_->tau();
  modal_force_ = actuator_forces_->modal_force();
}

ActuationSource::OnBody RecordedActuation::on_body(std::size_t body) {
  const Index n = system_.bodies[body].modes();
  OnBody found{q_.segment(system_.first_coordinate[body], 3 + n), {}};
  driving_force(
      system_, workspace_, [this](std::size_t r) { return is_trajectory_[r]; }, VectorXd::Zero(n), body, found.Q_a);
  return found;
}

} // namespace ffrobot
