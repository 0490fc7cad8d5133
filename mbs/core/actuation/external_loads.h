// Loads from outside a system's own: sizes of its drives, and modal forces.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace ffrobot {

struct ExternalForces {
  std::vector<double> drive;          // N or N m along each drive of the system
  std::vector<Eigen::VectorXd> modal; // on p of each body
  bool has_modal = false;             // else all of these are zero
};

class ExternalLoads {
public:
  virtual ~ExternalLoads() = default;
  virtual void apply(double t, ExternalForces &forces) = 0; // sets those of time t

  // As OdeSystem has them: the stages of a step that is tried, and where one had best end.
  virtual void foresee(const double *, int) {}
  virtual double end_of_step(double t, double h) { return t + h; }
};

} // namespace ffrobot
