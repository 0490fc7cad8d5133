// What an inverse analysis found that was done in absolute coordinates.
#pragma once

#include "core/actuation/actuator_forces.h"
#include "core/actuation/source.h"

#include <optional>

namespace ffrobot {

class SystemSource : public ActuationSource {
public:
  OnBody on_body(std::size_t body) override;

protected:
  // is_trajectory[i]: of constraint i. actuator_forces: empty where the motors do not fit the mechanism; then neither
  // tau nor modal forces are asked for.
  SystemSource(const System &system, std::vector<bool> is_trajectory, std::optional<ActuatorForces> actuator_forces);

  virtual const Workspace &workspace() const = 0; // kinematics, multipliers
  virtual const Eigen::VectorXd &q() const = 0;
  virtual const std::vector<Eigen::VectorXd> &shape_force() const { return modal_zero_; } // -lambda_p of each body

  void resolve(); // all forces from the workspace

private:
  const System &system_;
  std::vector<bool> is_trajectory_;
  std::optional<ActuatorForces> actuator_forces_;
  std::vector<Eigen::VectorXd> modal_zero_;
};

} // namespace ffrobot
