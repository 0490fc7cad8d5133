// Dormand and Prince's explicit method of order 5 with an estimate of order 4 and dense output of order 4.
#pragma once

#include "core/integrate/dopri5_tableau.h"
#include "core/integrate/method.h"

#include <algorithm>
#include <cmath>

namespace ffrobot {

class Dopri5 final : public Method {
public:
  explicit Dopri5(OdeSystem &system);

  bool step(double t, const double *y, double h, double tolerance) override;
  int stages() const override { return Dopri5Tableau::stages - 1; }
  double stage_time(int i, double t, double h) const override { return t + Dopri5Tableau::c[i + 1] * h; }
  const double *stage(int i, double t, const double *y, double h) override;
  bool finish(double t) override { return system_.finish(t, end_.data(), last_slope()); }
  void estimate(double h, Eigen::VectorXd &error) override;
  double error_order() const override { return 5; }
  double error_share(double fraction) const override { return std::min(std::sqrt(fraction) / 8, 3 * fraction); }

  bool lands_on_outputs() const override { return false; }
  void prepare_dense(double t, const double *y, double h) override;
  void interpolate(double t, double *y) const override;

  double *end() override { return end_.data(); }
  double *first_slope() override { return K_.data(); }
  double *last_slope() override { return K_.col(Dopri5Tableau::stages).data(); }

private:
  OdeSystem &system_;
  Eigen::Index n_;
  Eigen::MatrixXd K_; // slopes, (n, stages + 1)
  Eigen::VectorXd stage_, end_, start_;
  Eigen::MatrixXd F_; // (n, 4)
  double t0_ = 0, h_ = 0;
};

} // namespace ffrobot
