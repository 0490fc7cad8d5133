// What explicit Runge-Kutta methods share of which the slope at the end of a step is the first of the next.
#pragma once

#include "core/integrate/explicit_stages.h"
#include "core/integrate/method.h"

namespace ffrobot {

template <class Tableau> class ExplicitMethod : public Method {
public:
  int stages() const final { return Tableau::stages - 1; }
  double stage_time(int i, double t, double h) const final { return t + Tableau::c[i + 1] * h; }
  const double *stage(int i, double t, const double *y, double h) final {
    run_stage<Tableau, Tableau::stages - 1>(i + 1, system_, stage_time(i, t, h), y, h, K_, stage_);
    return stage_.data();
  }
  bool finish(double t) final { return system_.finish(t, end_.data(), last_slope()); }

  bool lands_on_outputs() const final { return false; }
  // A polynomial in the share x of the step and in 1 - x, by turns
  void interpolate(double t, double *y) const final {
    const double x = (t - t0_) / h_;
    for_entries<1>(n_, [&]<class T, int>(Index i) __attribute__((always_inline)) {
      T out{};
      for (int k = Tableau::dense_order - 1; k >= 0; --k)
        out = (k % 2 == 0 ? x : 1 - x) * (out + read_at<T>(F_.data() + k * n_ + i));
      write_at(y + i, read_at<T>(start_.data() + i) + out);
    });
  }

  double *end() final { return end_.data(); }
  double *first_slope() final { return K_.data(); }
  double *last_slope() final { return K_.col(Tableau::stages).data(); }

protected:
  explicit ExplicitMethod(OdeSystem &system)
      : system_(system), n_(system.size()), K_(MatrixXd::Zero(n_, Tableau::dense_stages)), stage_(n_), end_(n_),
        start_(n_), F_(n_, Tableau::dense_order) {}

  OdeSystem &system_;
  Index n_;
  MatrixXd K_; // slopes, (n, dense_stages)
  VectorXd stage_, end_, start_;
  MatrixXd F_; // (n, dense_order)
  double t0_ = 0, h_ = 0;
};

} // namespace ffrobot
