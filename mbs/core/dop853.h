// One step of DOP853 (Hairer, Norsett, Wanner 1993): order 8, error estimate of orders 5 and 3, dense output of
// order 7.
#pragma once

#include "core/dop853_tableau.h"
#include "core/ode.h"

#include <Eigen/Core>

namespace ffrobot {

class Dop853 {
public:
  static constexpr int error_order = 8; // the combined estimate shrinks as h^8

  explicit Dop853(Eigen::Index size);

  // From (t, y) with slope K.col(0) already in place; the result, before any correction, is in end().
  void step(OdeSystem &system, double t, const double *y, double h);

  double *end() { return end_.data(); }
  double *first_slope() { return K_.data(); }
  double *last_slope() { return K_.col(dop853_tableau::stages).data(); } // slope at end(), set by the caller

  // Error estimate of order 5, and the factor that the estimate of order 3 brings it down by; needs last_slope().
  double estimate(double h, Eigen::VectorXd &error);

  // Coefficients for interpolate() within the step just made; three more slopes.
  void prepare_dense(OdeSystem &system, double t, const double *y, double h);
  void interpolate(double t, double *y) const;

private:
  Eigen::Index n_;
  Eigen::MatrixXd K_; // slopes, (n, dense_stages)
  Eigen::VectorXd stage_, end_, start_;
  Eigen::MatrixXd F_; // (n, dense_order)
  double t0_ = 0, h_ = 0;
};

} // namespace ffrobot
