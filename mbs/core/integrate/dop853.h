// DOP853 (Hairer, Norsett, Wanner 1993): order 8, error estimate of orders 5 and 3, dense output of order 7.
#pragma once

#include "core/integrate/dop853_tableau.h"
#include "core/integrate/method.h"

#include <algorithm>
#include <cmath>

namespace ffrobot {

class Dop853 final : public Method {
public:
  explicit Dop853(OdeSystem &system);

  bool step(double t, const double *y, double h, double tolerance) override;
  int stages() const override { return Dop853Tableau::stages - 1; }
  double stage_time(int i, double t, double h) const override { return t + Dop853Tableau::c[i + 1] * h; }
  const double *stage(int i, double t, const double *y, double h) override;
  bool finish(double t) override { return system_.finish(t, end_.data(), last_slope()); }

  // Estimate of order 5, times a factor that the estimate of order 3 brings it down by: together they shrink as h^8.
  void estimate(double h, Eigen::VectorXd &error) override;
  double error_order() const override { return 8; }
  double error_share(double fraction) const override { return std::min(std::sqrt(fraction) / 10, 16 * fraction); }

  bool lands_on_outputs() const override { return false; }
  bool needs_slopes_between() const override { return true; } // three more
  void prepare_dense(double t, const double *y, double h) override;
  bool estimate_dense(Eigen::VectorXd &error) const override;
  void interpolate(double t, double *y) const override;

  double *end() override { return end_.data(); }
  double *first_slope() override { return K_.data(); }
  double *last_slope() override { return K_.col(Dop853Tableau::stages).data(); }

protected:
  double weight_of_rounding() const override { return 4.4; }

private:
  OdeSystem &system_;
  Eigen::Index n_;
  Eigen::MatrixXd K_; // slopes, (n, dense_stages)
  Eigen::VectorXd stage_, end_, start_;
  Eigen::VectorXd mean_; // of the slopes of the step, by weights
  Eigen::MatrixXd F_;    // (n, dense_order)
  double t0_ = 0, h_ = 0;
};

} // namespace ffrobot
