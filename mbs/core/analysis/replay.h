// Actuation from an earlier analysis that was integrated in absolute coordinates, at any time of it.
#pragma once

#include "core/actuation/actuator_forces.h"
#include "core/actuation/source.h"
#include "core/integrate/recorded_motion.h"

#include <optional>

namespace ffrobot {

class RecordedActuation final : public ActuationSource {
public:
  // is_trajectory[i]: of constraint i. actuator_forces: empty where the motors do not fit the mechanism; then neither
  // tau nor modal forces are asked for.
  RecordedActuation(const System &system, const Recording &recording, std::vector<bool> is_trajectory,
                    std::optional<ActuatorForces> actuator_forces);

  OnBody on_body(std::size_t body) override;

private:
  void find(double t) override;

  const System &system_;
  std::vector<bool> is_trajectory_;
  std::optional<ActuatorForces> actuator_forces_;
  ConstrainedMotion motion_;
  RecordedMotion recorded_;
  Workspace workspace_;
  Eigen::VectorXd q_, a_;
};

} // namespace ffrobot
