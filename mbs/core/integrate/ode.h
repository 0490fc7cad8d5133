// What an integrator needs to know of a system, and nothing else.
#pragma once

#include <Eigen/Core>

#include <complex>

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

  // What accepted() has gathered since the start, and the same given back to a run that goes on.
  virtual Eigen::VectorXd save() const = 0;
  virtual void restore(const Eigen::VectorXd &gathered) = 0;

  // Whether y is still something that the equations describe; where it is not, the run ends as diverged.
  virtual bool is_sensible(const double *y) const = 0;

  // First step size to try.
  virtual double initial_step() const = 0;

  virtual unsigned long evaluations() const = 0;
};

// What implicit methods need besides: y = (q, v) of M v_dot + C_q^T lambda = Q under constraints, and its stiff terms.
//
// The stiff terms of Q are -K q - D v with constant diagonals K and D. Newton's method on the equations of a step
// meets the block-arrow matrix N = M + damping_factor D + stiffness_factor K, real or complex, under C_q.
class ImplicitSystem : public OdeSystem {
public:
  using Complex = std::complex<double>;

  virtual Eigen::Index constraints() const = 0;
  virtual const Eigen::VectorXd &stiffness() const = 0; // (n), zero where nothing is stiff
  virtual const Eigen::VectorXd &damping() const = 0;   // (n)

  // M and C_q are those of the last slope().
  virtual void factorise(double damping_factor, double stiffness_factor) = 0;
  virtual void factorise(Complex damping_factor, Complex stiffness_factor) = 0;

  // Solves N x + C_q^T nu = r, C_q x = c: r (n), only where the stiffness or damping is not zero; c may be null for 0.
  virtual void solve(const double *r, const double *c, double *x) = 0;
  virtual void solve(const Complex *r, Complex *x) = 0;

  // c = C_q x, with C_q of the last real factorisation
  virtual void constrain(const double *x, double *c) = 0;

  // C and C_dot, both (constraints)
  virtual void constraint_values(double t, const double *y, double *value, double *rate) = 0;

  // Size of a change of y relative to the peaks so far, cheaper than error_size: instead of multipliers it looks at the
  // accelerations that a change of velocity is worth at `rate` (1/s).
  virtual double change_size(const double *y, const double *change, double rate) const = 0;
};

} // namespace ffrobot
