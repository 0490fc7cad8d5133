// What an integrator needs to know of a system, and nothing else.
#pragma once

#include <Eigen/Core>

namespace ffrobot {

class OdeSystem {
public:
  virtual ~OdeSystem() = default;

  virtual Eigen::Index size() const = 0;

  virtual void slope(double t, const double *y, double *dy) = 0;

  // Moves y back onto the system's invariants after a step; false where that fails (the step is then rejected).
  virtual bool correct(double t, double *y) = 0;

  // Size of the error e of y, relative to the peaks so far of the reported quantities: what the tolerance bounds.
  // Called directly after slope(t, y); may evaluate slopes of its own.
  virtual double error_size(double t, const double *y, const double *e) = 0;

  // The run starts at, or an accepted step ended in, (t, y, dy): the state of the last error_size, if any.
  virtual void accepted(double t, const double *y, const double *dy) = 0;

  // First step size to try.
  virtual double initial_step() const = 0;

  virtual unsigned long evaluations() const = 0;
};

} // namespace ffrobot
