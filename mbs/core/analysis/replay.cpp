#include "core/analysis/replay.h"

namespace ffrobot {

RecordedActuation::RecordedActuation(const System &system, const Recording &recording, std::vector<bool> is_trajectory,
                                     std::optional<ActuatorForces> actuator_forces)
    : SystemSource(system, std::move(is_trajectory), std::move(actuator_forces)), system_(system), motion_(system),
      recorded_(motion_, recording), workspace_(system), a_(system.n_v()) {
  motion_.norm().plan(recording.times.back() - recording.times.front());
}

void RecordedActuation::find(double t) {
  const double *y = recorded_.state(t);
  accelerations(system_, t, y, y + system_.n_q(), workspace_, a_.data());
  q_ = Eigen::Map<const Eigen::VectorXd>(y, system_.n_q());
  resolve();
}

FullyConstrainedActuation::FullyConstrainedActuation(const System &system, std::vector<ModalShape> shape,
                                                     Eigen::VectorXd guess, std::vector<bool> is_trajectory,
                                                     std::optional<ActuatorForces> actuator_forces)
    : SystemSource(system, std::move(is_trajectory), std::move(actuator_forces)), motion_(system, std::move(guess)),
      shape_(std::move(shape)) {}

void FullyConstrainedActuation::find(double t) {
  motion_.set_shape(t, shape_);
  motion_.solve(t); // was found at all output times before; a failure in between shows as a step that is refused
  resolve();
}

} // namespace ffrobot
