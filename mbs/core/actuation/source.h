// What an inverse analysis found, for the actuators of a forward run.
#pragma once

#include "core/actuation/actuator_forces.h"
#include "core/system/system.h"

#include <limits>
#include <optional>
#include <vector>

namespace ffrobot {

// What an inverse analysis found, at any time of it.
class ActuationSource {
public:
  virtual ~ActuationSource() = default;

  // Everything below is that of time t afterwards. Costs nothing where it is already: stages of a step and outputs
  // meet.
  void evaluate(double t) {
    if (t != time_)
      find(t);
    time_ = t;
  }

  virtual const System &system() const = 0;
  virtual const Workspace &workspace() const = 0; // kinematics, multipliers
  virtual const Eigen::VectorXd &q() const = 0;
  const Eigen::VectorXd &tau() const { return tau_; }                                     // (motors)
  const std::vector<Eigen::VectorXd> &modal_force() const { return modal_force_; }        // F_p of each body
  virtual const std::vector<Eigen::VectorXd> &shape_force() const { return modal_zero_; } // -lambda_p of each body
  bool is_trajectory(std::size_t constraint) const { return is_trajectory_[constraint]; }

protected:
  // actuator_forces: empty where the motors do not fit the mechanism; then neither tau nor modal forces are asked for.
  ActuationSource(const System &system, std::vector<bool> is_trajectory, std::optional<ActuatorForces> actuator_forces);

  virtual void find(double t) = 0;
  void resolve(); // tau and F_p from the workspace

private:
  double time_ = std::numeric_limits<double>::quiet_NaN();
  std::vector<bool> is_trajectory_;
  std::optional<ActuatorForces> actuator_forces_;
  Eigen::VectorXd tau_;
  std::vector<Eigen::VectorXd> modal_force_, modal_zero_;
};

} // namespace ffrobot
