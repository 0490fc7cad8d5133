// DOP853 (Hairer, Norsett, Wanner 1993): order 8, error estimate of orders 5 and 3, dense output of order 7.
#pragma once

#include "core/integrate/dop853_tableau.h"
#include "core/integrate/explicit_method.h"

#include <algorithm>
#include <cmath>

namespace ffrobot {

class Dop853 final : public ExplicitMethod<Dop853Tableau> {
public:
  explicit Dop853(OdeSystem &system);

  bool step(double t, const double *y, double h, double tolerance) override;
  // Estimate of order 5, times a factor that the estimate of order 3 brings it down by: together they shrink as h^8.
  void estimate(double h, Eigen::VectorXd &error) override;
  double error_order() const override { return 8; }
  double error_share(double fraction) const override { return std::min(std::sqrt(fraction) / 10, 16 * fraction); }

  bool needs_slopes_between() const override { return true; } // three more
  void prepare_dense(double t, const double *y, double h) override;
  bool estimate_dense(Eigen::VectorXd &error) const override;

protected:
  double weight_of_rounding() const override { return 4.4; }

private:
  Eigen::VectorXd mean_; // of the slopes of the step, by weights
};

} // namespace ffrobot
