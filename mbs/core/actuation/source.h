// What an inverse analysis found, for the actuators of a forward run.
#pragma once

#include "core/system/system.h"

#include <limits>
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

  const Eigen::VectorXd &trajectory_force() const { return trajectory_force_; } // -lambda_s, constraint by constraint
  const Eigen::VectorXd &tau() const { return tau_; }                           // (motors)
  const std::vector<Eigen::VectorXd> &modal_force() const { return modal_force_; } // F_p of each body

  // Q_a of what holds trajectories, and a shape that is prescribed, on the coordinates (R, theta, p) of one body, and q
  // of these.
  struct OnBody {
    Eigen::VectorXd q, Q_a;
  };
  virtual OnBody on_body(std::size_t body) = 0;

protected:
  explicit ActuationSource(const System &system);

  virtual void find(double t) = 0; // fills what is below; tau and F_p where motors fit the mechanism

  Eigen::VectorXd trajectory_force_, tau_;
  std::vector<Eigen::VectorXd> modal_force_;

private:
  double time_ = std::numeric_limits<double>::quiet_NaN();
};

} // namespace ffrobot
