// Stages of explicit Runge-Kutta methods whose coefficients the compiler knows: zeros cost nothing.
#pragma once

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

} // namespace ffrobot
