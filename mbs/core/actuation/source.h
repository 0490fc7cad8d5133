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
      time_ = find(t) ? t : nowhere;
  }

  // As OdeSystem has them: the next times will be the stages of a step, and where one had best end.
  void foresee(const double *times, int count) {
    time_ = nowhere;
    prepare(times, count);
  }
  virtual double end_of_step(double t, double h) { return t + h; }

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

  // Fills what is below; tau and F_p where motors fit the mechanism. False where it is of a stage of a step, not of
  // time t at any other moment.
  virtual bool find(double t) = 0;
  virtual void prepare(const double *, int) {}

  Eigen::VectorXd trajectory_force_, tau_;
  std::vector<Eigen::VectorXd> modal_force_;

private:
  static constexpr double nowhere = std::numeric_limits<double>::quiet_NaN();
  double time_ = nowhere;
};

} // namespace ffrobot
