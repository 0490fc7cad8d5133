// What explicit Runge-Kutta methods share of which the slope at the end of a step is the first of the next.
#pragma once

#include "core/integrate/method.h"
#include "core/integrate/ode.h"
#include "core/recursion/numbers/four_doubles.h"
#include <cstddef>
#include <utility>

namespace ffrobot {

// sum of coefficient[j] * K_j over the nonzero coefficients, of which the first is one, of `parts` T side by side from
// entry i on; K holds the slopes (n) one after the other. All parts of a slope are read before those of the next: sums
// stay in registers, and one address and one coefficient after the other will do.
template <const auto &Coefficients, int Count, class T, int parts> struct Combination {
  static constexpr Index width = sizeof(T) / sizeof(double);
  T sum[parts];

  [[gnu::always_inline]] Combination(const double *K, Index n, Index i) {
    static_assert(Coefficients[0] != 0); // sums do not begin with a zero, which would be added
    K += i;
#pragma GCC unroll 8
    for (int part = 0; part < parts; ++part)
      sum[part] = Coefficients[0] * read_at<T>(K + part * width);
    const auto add = [&]<std::size_t j>() __attribute__((always_inline)) {
      K += n;
      if constexpr (Coefficients[j] != 0) {
#pragma GCC unroll 8
        for (int part = 0; part < parts; ++part)
          sum[part] += Coefficients[j] * read_at<T>(K + part * width);
      }
    };
    [&]<std::size_t... j>(std::index_sequence<j...>) __attribute__((always_inline)) {
      (add.template operator()<j + 1>(), ...);
    }(std::make_index_sequence<Count - 1>());
  }
};

// visit.operator()<T, parts>(i) for all entries, many at once. The last ones reach back into those before, which come
// out the same again, in place of a remainder one by one.
template <int most_parts, class Visit> [[gnu::always_inline]] inline void for_entries(Index n, const Visit &visit) {
  const auto all = [&]<class T, int parts>() __attribute__((always_inline)) {
    constexpr Index count = parts * sizeof(T) / sizeof(double);
    Index i = 0;
    for (; i + count <= n; i += count)
      visit.template operator()<T, parts>(i);
    if (i < n)
      visit.template operator()<T, parts>(n - count);
  };
  if (n >= 4 * most_parts)
    all.template operator()<FourDoubles, most_parts>();
  else if (n >= 4)
    all.template operator()<FourDoubles, 1>();
  else
    all.template operator()<double, 1>();
}

// out = y + h times that sum
template <const auto &Coefficients, int Count>
void advance(const double *K, Index n, double h, const double *y, double *out) {
  for_entries<6>(n, [&]<class T, int parts>(Index i) __attribute__((always_inline)) {
    const Combination<Coefficients, Count, T, parts> of(K, n, i);
#pragma GCC unroll 8
    for (int part = 0; part < parts; ++part, i += of.width)
      write_at(out + i, read_at<T>(y + i) + h * of.sum[part]);
  });
}

// Slope number Stage of the tableau (rows a), at time t, from the slopes before it
template <class Tableau, int Stage>
void run_stage(OdeSystem &system, double t, const double *y, double h, MatrixXd &K, VectorXd &stage) {
  static constexpr auto &row = Tableau::a[Stage];
  advance<row, Stage>(K.data(), K.rows(), h, y, stage.data());
  system.slope(t, stage.data(), K.col(Stage).data());
}

// The same where the number is known only now, from 1 on.
template <class Tableau, int Last>
void run_stage(int number, OdeSystem &system, double t, const double *y, double h, MatrixXd &K, VectorXd &stage) {
  [&]<int... i>(std::integer_sequence<int, i...>) {
    ((number == i + 1 ? run_stage<Tableau, i + 1>(system, t, y, h, K, stage) : void()), ...);
  }(std::make_integer_sequence<int, Last>());
}

// Slopes First … Last of the tableau (nodes c)
template <class Tableau, int First, int Last>
void run_stages(OdeSystem &system, double t, const double *y, double h, MatrixXd &K, VectorXd &stage) {
  [&]<int... i>(std::integer_sequence<int, i...>) {
    const double times[] = {t + Tableau::c[First + i] * h...};
    system.set_stage_times(times, sizeof...(i));
    (run_stage<Tableau, First + i>(system, times[i], y, h, K, stage), ...);
  }(std::make_integer_sequence<int, Last - First + 1>());
}

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
