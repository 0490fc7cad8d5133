// What an inverse analysis found, for the actuators of a forward run.
#pragma once

#include "core/actuation/force_source.h"
#include "core/system/system.h"

#include <vector>

namespace ffrobot {

// What an inverse analysis found, at any time of it.
class ActuationSource : public TimedSource {
public:
  const Eigen::VectorXd &trajectory_force() const { return trajectory_force_; } // -lambda_s, constraint by constraint
  virtual const Eigen::VectorXd &tau() { return tau_; }                         // (motors)
  virtual const std::vector<Eigen::VectorXd> &modal_force() { return modal_force_; } // F_p of each body

  // Q_a of what holds trajectories, and a shape that is prescribed, on the coordinates (R, theta, p) of one body, and q
  // of these.
  struct OnBody {
    Eigen::VectorXd q, Q_a;
  };
  virtual OnBody on_body(std::size_t body) = 0;

protected:
  explicit ActuationSource(const System &system);

  // Filled by find(); tau and F_p where motors fit the mechanism.
  Eigen::VectorXd trajectory_force_, tau_;
  std::vector<Eigen::VectorXd> modal_force_;
};

} // namespace ffrobot
