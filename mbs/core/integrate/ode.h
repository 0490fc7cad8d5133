// What an integrator needs to know of a system, and nothing else.
#pragma once

#include "core/space/local_coordinates.h"

#include <complex>

namespace ffrobot {

// States y = (q, v) have n_q + n_v entries. Methods step in local coordinates z (see local_coordinates.h), their rates
// and increments, 2 n_v each: they are y, dy and so on there, as in the formulas for vector spaces. Where q consists of
// numbers alone, both are the same.
//
// Implicit methods see M v_dot + C_q^T lambda = Q under constraints, and its stiff terms: those of Q are
// -B^T (K B q + D B v) with diagonals K and D, zero on rotations, and B the identity over the rows of coupling()^T:
// along coordinates that v does not have. K and D are slopes at the last linearise(), those of friction among them.
// Newton's method on the equations of a step meets N = M + B^T (damping_factor D + stiffness_factor K) B, real or
// complex, under C_q: block-arrow without coupling.
class OdeSystem {
public:
  using Complex = std::complex<double>;

  explicit OdeSystem(const ConfigurationSpace &space) : local_(space) {}
  virtual ~OdeSystem() = default;

  Index n_v() const { return local_.space().n_v(); }
  Index size() const { return local_.size(); } // of z: 2 n_v
  LocalCoordinates &local() { return local_; }
  const LocalCoordinates &local() const { return local_; }

  // z_dot (2 n_v) at z
  virtual void slope(double t, const double *z, double *z_dot) = 0;

  // The next slopes will be at these times (count): what depends on time alone can be found for all at once.
  virtual void set_stage_times(const double *times, int count) = 0;

  // Where a step from t on that could be of length h had best end: what acts may cost less at times that it knows.
  virtual double end_of_step(double t, double h) = 0;

  // What rounding of every part by `relative` leaves in the last slope(), near z, where parts of it cancel, as loads
  // and what carries them: z_dot (2 n_v). Another slope() has to follow before error_size() or accepted().
  virtual void round_off(const double *z, double relative, double *z_dot) = 0;

  // Moves z back onto the system's invariants after a step, and finds the slope there; false where that fails (the step
  // is then rejected).
  virtual bool finish(double t, double *z, double *z_dot) = 0;

  // Size of the error e of z, relative to the peaks so far of the reported quantities: what the tolerance bounds.
  // The last slope() was that at (t, z); may evaluate slopes of its own.
  virtual double error_size(double t, const double *z, const double *e) = 0;

  // Size of a change of z relative to the peaks so far, cheaper than error_size: instead of multipliers it looks at the
  // accelerations that a change of velocity is worth at `rate` (1/s).
  virtual double change_size(const double *z, const double *change, double rate) const = 0;

  // The run starts at, or an accepted step ended in, (t, z, z_dot).
  virtual void accepted(double t, const double *z, const double *z_dot) = 0;

  // Whether z is still something that the equations describe; where it is not, the run ends as diverged.
  virtual bool is_sensible(const double *z) const = 0;

  // Functions of time alone that slopes follow, as many as prescribed(): loads, accelerations of paths.
  virtual Index prescribed() const = 0;
  virtual void prescribe(double t, double *f) = 0;

  // First step size to try: a tenth of the fastest vibration's radian.
  virtual double initial_step() const = 0;

  virtual unsigned long evaluations() const = 0;

  virtual Index constraints() const = 0;         // rows of C, and of multipliers
  virtual const VectorXd &stiffness() const = 0; // (n_stiff), zero where nothing is stiff
  virtual const VectorXd &damping() const = 0;   // (n_stiff)
  virtual const MatrixXd &coupling() const = 0;  // (n_v, n_stiff - n_v)
  Index n_stiff() const { return n_v() + coupling().cols(); }

  // M, C_q and D of the next factorisations are those at (t, z).
  virtual void linearise(double t, const double *z) = 0;
  virtual void factorise(double damping_factor, double stiffness_factor) = 0;
  virtual void factorise(Complex damping_factor, Complex stiffness_factor) = 0;

  // Solves N x + C_q^T nu = B^T r, C_q x = c with the last factorisation of that kind: r (n_stiff), only where the
  // stiffness or damping is not zero; c (constraints) may be null for 0.
  virtual void solve(const double *r, const double *c, double *x) = 0;
  virtual void solve(const Complex *r, Complex *x) = 0;

  // c (constraints) = C_q x
  virtual void constrain(const double *x, double *c) = 0;

  // C and C_dot, both (constraints)
  virtual void constraint_values(double t, const double *z, double *value, double *rate) = 0;

  // Largest of them (constraints) at z, relative to natural sizes: rounding leaves some 1e-15, in any units.
  virtual double value_size(const double *z, const VectorXd &value) const = 0;
  virtual double rate_size(const double *z, const VectorXd &rate) const = 0;

private:
  LocalCoordinates local_;
};

} // namespace ffrobot
