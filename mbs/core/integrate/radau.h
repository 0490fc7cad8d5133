// Radau IIA with three stages: order 5, stiffly accurate, L-stable. E. Hairer, G. Wanner, Solving Ordinary Differential
// Equations II, 2nd ed. 1996, secs. IV.5 and IV.8: simplified Newton in the eigenvectors of A^-1, an estimate of
// order 3.
#pragma once

#include "core/integrate/implicit_projection.h"
#include "core/integrate/method.h"

namespace ffrobot {

class Radau final : public Method {
public:
  explicit Radau(OdeSystem &system);

  bool step(double t, const double *y, double h, double tolerance) override;
  bool finish(double t) override;
  void estimate(double h, Eigen::VectorXd &error) override;
  void slopes_to_error(double h, Eigen::VectorXd &x) override;
  double error_order() const override { return 6; }
  // Half of what most runs need: where many modes ring undamped over a thousand radians and more, small errors of slow
  // motion grow to phases of the fastest.
  double error_share(double fraction) const override { return 0.75 * fraction; }
  bool damps() const override { return true; }
  void accept(double h) override;
  void restart() override { previous_step_ = 0; }
  void recentred() override { restart(); } // slopes of earlier steps are rates of other coordinates

  bool lands_on_outputs() const override { return true; } // between steps it is of order 3 only
  void prepare_dense(double t, const double *y, double h) override;
  void interpolate(double t, double *y) const override;

  double *end() override { return end_.data(); }
  double *first_slope() override { return first_slope_.data(); }
  double *last_slope() override { return last_slope_.data(); }

private:
  using Complex = OdeSystem::Complex;

  void factorise(double t, const double *y, double h);
  bool solve_stages(double t, const double *y, double h, double tolerance); // by Newton's method, from predict()
  bool correct(double t);                                                   // moves end_ back onto the invariants
  void predict(double h);
  void iterate(double t, const double *y, double h);
  double largest_change(const double *y, double rate) const;
  // x: right-hand side of (mu I - J) x = r in, solution out, J the Jacobian of (q, v) -> (v, v_dot)
  template <class Scalar> void solve(Scalar mu, Eigen::Matrix<Scalar, Eigen::Dynamic, 1> &x);

  OdeSystem &system_;
  ImplicitProjection project_;
  Eigen::Index n_;                           // n_v: half the size of y
  Eigen::MatrixXd Z_, W_, F_, change_;       // (2n, 3): stages less y, the same in eigenvectors, slopes, Newton's step
  Eigen::MatrixXd collocation_;              // (2n, 3) coefficients of the last accepted step's polynomial
  Eigen::MatrixXd slopes_, previous_slopes_; // (2n, 3) of that polynomial at its stages, and of the one before
  Eigen::VectorXd stage_, end_, start_, first_slope_, last_slope_, real_, force_, unknown_;
  Eigen::VectorXcd complex_, complex_force_, complex_unknown_;
  double factorised_step_ = 0, previous_step_ = 0, contraction_ = 1, t0_ = 0, h_ = 0, weight_ = 1;
  bool stale_ = true; // the geometry of the last factorisation
};

} // namespace ffrobot
