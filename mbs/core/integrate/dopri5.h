// Dormand and Prince's explicit method of order 5 with an estimate of order 4 and dense output of order 4.
#pragma once

#include "core/integrate/dopri5_tableau.h"
#include "core/integrate/explicit_method.h"

#include <cmath>

namespace ffrobot {

class Dopri5 final : public ExplicitMethod<Dopri5Tableau> {
public:
  using Tableau = Dopri5Tableau;
  explicit Dopri5(OdeSystem &system) : ExplicitMethod(system) {}

  bool step(double t, const double *y, double h, double) override {
    run_stages<Tableau, 1, Tableau::stages - 1>(system_, t, y, h, K_, stage_);
    advance<Tableau::b, Tableau::stages>(K_.data(), n_, h, y, end_.data());
    return true;
  }
  void estimate(double h, VectorXd &error) override {
    for_entries<1>(n_, [&]<class T, int>(Index i) __attribute__((always_inline)) {
      const Combination<Tableau::e, Tableau::dense_stages, T, 1> of(K_.data(), n_, i);
      write_at(error.data() + i, h * of.sum[0]);
    });
  }
  double error_order() const override { return 5; }
  double error_share(double fraction) const override { return std::min(std::sqrt(fraction) / 8, 3 * fraction); }

  void prepare_dense(double t, const double *y, double h) override {
    t0_ = t;
    h_ = h;
    start_ = Map<const VectorXd>(y, n_);
    F_.col(0) = end_ - start_;
    F_.col(1) = h * K_.col(0) - F_.col(0);
    F_.col(2) = F_.col(0) - h * K_.col(Tableau::stages) - F_.col(1);
    F_.col(3).setZero();
    for (Index j = 0; j < Tableau::dense_stages; ++j)
      F_.col(3) += (h * Tableau::d[j]) * K_.col(j);
  }
};

} // namespace ffrobot
