// One-step methods, interchangeable: what the driver of an integration (integrate.h) needs of them.
#pragma once

#include "core/fields.h"
#include "core/integrate/ode.h"

#include <memory>

namespace ffrobot {

class Method {
public:
  virtual ~Method() = default;

  // One step from (t, y) with the slope there in first_slope(); the result, before any correction, is in end(). States
  // here are local coordinates (ode.h), whose centre is where the step starts.
  // `tolerance` bounds what iterations may leave. False where the equations of the step could not be solved.
  virtual bool step(double t, const double *y, double h, double tolerance) = 0;

  // Explicit methods: the stages of such a step after its first slope, of which a step has `stages`, one by one.
  // Returns the state of number i.
  virtual int stages() const { return 0; }
  virtual double stage_time(int, double t, double) const { return t; }
  virtual const double *stage(int, double, const double *, double) { return nullptr; }

  // Moves end() back onto the invariants, and finds last_slope() there; false where that fails.
  virtual bool finish(double t) = 0;

  // Error of the step of size h just made; needs last_slope().
  virtual void estimate(double h, VectorXd &error) = 0;

  // Slopes `x` off by as much at every stage, each by another amount, become the error that the estimate of such a step
  // sees, at most.
  virtual void slopes_to_error(double h, VectorXd &x) {
    const Index n = x.size() / 2;
    x *= h * weight_of_rounding();
    x.head(n) += h * x.tail(n); // a coordinate, by its rate
  }

  virtual double error_order() const = 0; // the estimate shrinks as h^error_order

  // Part of the tolerance that the estimate of one step may take, which covers `fraction` of the run. The estimates of
  // single steps add up like a random walk where errors scatter, step by step where they all point the same way, as
  // those of a vibration's phase do in a long run; factors are from tests/mbs/test_integrator.py and
  // tests/campaigns/tolerance.py, errors against tolerances.
  virtual double error_share(double fraction) const = 0;

  // Whether a step leaves little of vibrations that it does not resolve. They are an error once, not at every step.
  virtual bool damps() const { return false; }

  // The step just made was accepted: its corrected end and last slope are those of the next step's start.
  virtual void accept(double) {}

  // Loads jump here, and the first slope with them: what earlier steps tell of slopes is of no use for the next.
  virtual void restart() {}

  // The next step has local coordinates about another centre.
  virtual void recentred() {}

  // Whether steps have to end at output times, or there is an interpolation as good as the steps.
  virtual bool lands_on_outputs() const = 0;

  // Coefficients for interpolate() within the step just made, and whether they take slopes between its ends.
  virtual bool needs_slopes_between() const { return false; }
  virtual void prepare_dense(double t, const double *y, double h) = 0;

  // Largest error of interpolate() within the step, once prepared; false where it is never much more than that of the
  // step's end.
  virtual bool estimate_dense(VectorXd &) const { return false; }
  virtual void interpolate(double t, double *y) const = 0;

  virtual double *end() = 0;
  virtual double *first_slope() = 0;
  virtual double *last_slope() = 0;

protected:
  virtual double weight_of_rounding() const { return 1; } // of slopes in the estimate, twice the root of their squares
};

// Hermite's cubic at the part x of a step of length h, through its ends and slopes there
template <class Vector>
VectorXd hermite(double x, double h, const VectorXd &start, const Vector &end, const Vector &first_slope,
                 const Vector &last_slope) {
  const double left = 1 - x;
  return left * left * (1 + 2 * x) * start + x * x * (1 + 2 * left) * end +
         x * left * h * (left * first_slope - x * last_slope);
}

enum class MethodKind { dopri5, dop853, radau, generalized_alpha };

struct MethodChoice {
  MethodKind kind = MethodKind::dop853;
  double spectral_radius = 0.8; // of generalized-alpha at infinite frequency

  FFROBOT_FIELDS(kind, spectral_radius);
};

// The system must outlive the method.
std::unique_ptr<Method> make_method(const MethodChoice &choice, OdeSystem &system);

} // namespace ffrobot
