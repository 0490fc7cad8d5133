// Radau IIA with three stages: order 5, stiffly accurate, L-stable. E. Hairer, G. Wanner, Solving Ordinary Differential
// Equations II, 2nd ed. 1996, secs. IV.5 and IV.8: simplified Newton in the eigenvectors of A^-1, an estimate of
// order 3.
#pragma once

#include "core/integrate/implicit_method.h"

#include <tuple>

namespace ffrobot {

class Radau final : public ImplicitMethod {
public:
  explicit Radau(OdeSystem &system);

  bool step(double t, const double *y, double h, double tolerance) override;
  void estimate(double h, VectorXd &error) override;
  void slopes_to_error(double h, VectorXd &x) override;
  double error_order() const override { return 6; }
  // Half of what most runs need: where many modes ring undamped over a thousand radians and more, small errors of slow
  // motion grow to phases of the fastest.
  double error_share(double fraction) const override { return 0.75 * fraction; }
  bool damps() const override { return true; }
  void accept(double h) override;
  void restart() override { previous_step_ = 0; }
  void recentred() override { restart(); } // slopes of earlier steps are rates of other coordinates

  void prepare_dense(double t, const double *y, double h) override;
  void interpolate(double t, double *y) const override; // of order 3 only

private:
  using Complex = OdeSystem::Complex;

  void factorise(double t, const double *y, double h);
  bool solve_stages(double t, const double *y, double h, double tolerance); // by Newton's method, from predict()
  bool correct(double t) override;
  void predict(double h);
  void iterate(double t, const double *y, double h);
  double largest_change(const double *y, double rate) const;
  // x: right-hand side of (mu I - J) x = r in, solution out, J the Jacobian of (q, v) -> (v, v_dot)
  template <class Scalar> void solve(Scalar mu, Matrix<Scalar, Dynamic, 1> &x);

  MatrixXd Z_, W_, F_, change_;       // (2n, 3): stages less y, the same in eigenvectors, slopes, Newton's step
  MatrixXd collocation_;              // (2n, 3) coefficients of the last accepted step's polynomial
  MatrixXd slopes_, previous_slopes_; // (2n, 3) of that polynomial at its stages, and of the one before
  VectorXd stage_, real_;
  VectorXcd complex_;
  template <class Scalar> struct Linear { // of solve()
    Matrix<Scalar, Dynamic, 1> force, unknown;
  };
  std::tuple<Linear<double>, Linear<Complex>> linear_;
  double factorised_step_ = 0, previous_step_ = 0, contraction_ = 1, weight_ = 1;
};

} // namespace ffrobot
