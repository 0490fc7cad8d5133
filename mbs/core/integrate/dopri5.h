// Dormand and Prince's explicit method of order 5 with an estimate of order 4 and dense output of order 4.
#pragma once

#include "core/integrate/dopri5_tableau.h"
#include "core/integrate/explicit_method.h"

#include <algorithm>
#include <cmath>

namespace ffrobot {

class Dopri5 final : public ExplicitMethod<Dopri5Tableau> {
public:
  explicit Dopri5(OdeSystem &system);

  bool step(double t, const double *y, double h, double tolerance) override;
  void estimate(double h, Eigen::VectorXd &error) override;
  double error_order() const override { return 5; }
  double error_share(double fraction) const override { return std::min(std::sqrt(fraction) / 8, 3 * fraction); }

  void prepare_dense(double t, const double *y, double h) override;
};

} // namespace ffrobot
