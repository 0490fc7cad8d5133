#include "core/integrate/dopri5.h"

namespace ffrobot {

using Eigen::Index;
using Tableau = Dopri5Tableau;

Dopri5::Dopri5(OdeSystem &system) : ExplicitMethod(system) {}

bool Dopri5::step(double t, const double *y, double h, double) {
  run_stages<Tableau, 1, Tableau::stages - 1>(system_, t, y, h, K_, stage_);
  advance<Tableau::b, Tableau::stages>(K_.data(), n_, h, y, end_.data());
  return true;
}

void Dopri5::estimate(double h, Eigen::VectorXd &error) {
  for_entries<1>(n_, [&]<class T, int>(Index i) __attribute__((always_inline)) {
    const Combination<Tableau::e, Tableau::dense_stages, T, 1> of(K_.data(), n_, i);
    write_at(error.data() + i, h * of.sum[0]);
  });
}

void Dopri5::prepare_dense(double t, const double *y, double h) {
  t0_ = t;
  h_ = h;
  start_ = Eigen::Map<const Eigen::VectorXd>(y, n_);
  F_.col(0) = end_ - start_;
  F_.col(1) = h * K_.col(0) - F_.col(0);
  F_.col(2) = F_.col(0) - h * K_.col(Tableau::stages) - F_.col(1);
  F_.col(3).setZero();
  for (Index j = 0; j < Tableau::dense_stages; ++j)
    F_.col(3) += (h * Tableau::d[j]) * K_.col(j);
}

} // namespace ffrobot
