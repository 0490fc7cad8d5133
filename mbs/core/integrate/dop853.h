// DOP853 (Hairer, Norsett, Wanner 1993): order 8, error estimate of orders 5 and 3, dense output of order 7.
#pragma once

#include "core/integrate/dop853_tableau.h"
#include "core/integrate/explicit_method.h"

#include <cmath>
#include <limits>

namespace ffrobot {

class Dop853 final : public ExplicitMethod<Dop853Tableau> {
public:
  using Tableau = Dop853Tableau;
  explicit Dop853(OdeSystem &system) : ExplicitMethod(system), mean_(n_) {}

  bool step(double t, const double *y, double h, double) override {
    run_stages<Tableau, 1, Tableau::stages - 1>(system_, t, y, h, K_, stage_);
    for_entries<6>(n_, [&]<class T, int parts>(Index i) __attribute__((always_inline)) {
      const Combination<Tableau::b, Tableau::stages, T, parts> of(K_.data(), n_, i);
#pragma GCC unroll 8
      for (int part = 0; part < parts; ++part, i += of.width) {
        write_at(mean_.data() + i, of.sum[part]);
        write_at(end_.data() + i, read_at<T>(y + i) + h * of.sum[part]);
      }
    });
    return true;
  }

  // Estimate of order 5, times a factor that the estimate of order 3 brings it down by: together they shrink as h^8. A
  // coordinate and its rate have one factor, and every pair its own: large slow motion, whose estimate of order 5 is
  // far below that of order 3, would bring the error of fast vibration down as well.
  void estimate(double h, VectorXd &error) override {
    constexpr double least = std::numeric_limits<double>::min(); // where nothing moves there is no error
    const Index n_v = n_ / 2;
    for_entries<1>(n_v, [&]<class T, int>(Index i) __attribute__((always_inline)) {
      const Index i_v = n_v + i;
      const auto of5 = [&](Index at) __attribute__((always_inline)) {
        return Combination<Tableau::e5, Tableau::stages, T, 1>(K_.data(), n_, at).sum[0];
      };
      const auto of3 = [&](Index at) __attribute__((always_inline)) {
        return read_at<T>(mean_.data() + at) +
               Combination<Tableau::e3_beside_b, Tableau::stages, T, 1>(K_.data(), n_, at).sum[0];
      };
      const T q5 = of5(i), v5 = h * of5(i_v), q3 = of3(i), v3 = h * of3(i_v);
      const T square5 = q5 * q5 + v5 * v5, square = square5 + 0.01 * (q3 * q3 + v3 * v3);
      const T factor = square_root(square5 / (square < least ? T{} + least : square)); // keeps NaN
      write_at(error.data() + i, h * factor * q5), write_at(error.data() + i_v, factor * v5);
    });
  }
  double error_order() const override { return 8; }
  double error_share(double fraction) const override { return std::min(std::sqrt(fraction) / 10, 16 * fraction); }

  bool needs_slopes_between() const override { return true; } // three more
  void prepare_dense(double t, const double *y, double h) override {
    run_stages<Tableau, Tableau::stages + 1, Tableau::dense_stages - 1>(system_, t, y, h, K_, stage_);
    t0_ = t;
    h_ = h;
    for_entries<1>(n_, [&]<class T, int>(Index i) __attribute__((always_inline)) {
      const T start = read_at<T>(y + i), way = read_at<T>(end_.data() + i) - start;
      const T first = h * read_at<T>(K_.data() + i), last = h * read_at<T>(last_slope() + i);
      double *F = F_.data() + i;
      write_at(start_.data() + i, start);
      write_at(F, way), write_at(F + n_, first - way), write_at(F + 2 * n_, 2 * way - (last + first));
      [&]<int... k>(std::integer_sequence<int, k...>) __attribute__((always_inline)) {
        (write_at(F + (3 + k) * n_, h * dense_sum<Tableau, k, T>(K_.data(), n_, i)), ...);
      }(std::make_integer_sequence<int, 4>());
    });
  }

  // The last term of the interpolation is at most (4/7)^4 (3/7)^3 of its coefficient. On a vibration of 0.3 to 7
  // radians a step it is 6 to 7 times the largest error, which is 3 times the estimate of the step as long as that is
  // stable and 8 times where it is not.
  bool estimate_dense(VectorXd &error) const override {
    constexpr double largest_of_last = 0.0084, of_error = 6;
    error = largest_of_last / of_error * F_.col(Tableau::dense_order - 1);
    return true;
  }

protected:
  double weight_of_rounding() const override { return 4.4; }

private:
  static double square_root(double x) { return std::sqrt(x); }
  static FourDoubles square_root(FourDoubles x) {
    for (int i = 0; i < 4; ++i)
      x[i] = std::sqrt(x[i]);
    return x;
  }

  // Weighted sum of the slopes in row k of the dense output
  template <class Of, int k, class T> [[gnu::always_inline]] static T dense_sum(const double *K, Index n, Index i) {
    static constexpr auto &row = Of::d[k];
    return Combination<row, Of::dense_stages, T, 1>(K, n, i).sum[0];
  }

  VectorXd mean_; // of the slopes of the step, by weights
};

} // namespace ffrobot
