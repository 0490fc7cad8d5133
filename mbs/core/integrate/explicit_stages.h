// Stages of explicit Runge-Kutta methods whose coefficients the compiler knows: zeros cost nothing.
#pragma once

#include "core/integrate/ode.h"

#include <utility>

namespace ffrobot {

// sum of coefficient[j] * K_j[i] over the nonzero coefficients
template <const auto &Coefficients, std::size_t... j>
[[gnu::always_inline]] inline double combine(const double *K, Eigen::Index n, Eigen::Index i,
                                             std::index_sequence<j...>) {
  const auto term = [&]<std::size_t J>() {
    if constexpr (Coefficients[J] != 0)
      return Coefficients[J] * K[static_cast<Eigen::Index>(J) * n + i];
    else
      return 0.0;
  };
  return (term.template operator()<j>() + ...);
}

// out = y + h times that sum; K holds the slopes one after the other
template <const auto &Coefficients, int Count>
void advance(const double *K, Eigen::Index n, double h, const double *y, double *__restrict out) {
  for (Eigen::Index i = 0; i < n; ++i)
    out[i] = y[i] + h * combine<Coefficients>(K, n, i, std::make_index_sequence<Count>());
}

// Slope number Stage of the tableau (rows a), at time t, from the slopes before it
template <class Tableau, int Stage>
void run_stage(OdeSystem &system, double t, const double *y, double h, Eigen::MatrixXd &K, Eigen::VectorXd &stage) {
  static constexpr auto &row = Tableau::a[Stage];
  advance<row, Stage>(K.data(), K.rows(), h, y, stage.data());
  system.slope(t, stage.data(), K.col(Stage).data());
}

// Slopes First … Last of the tableau (nodes c)
template <class Tableau, int First, int Last>
void run_stages(OdeSystem &system, double t, const double *y, double h, Eigen::MatrixXd &K, Eigen::VectorXd &stage) {
  [&]<int... i>(std::integer_sequence<int, i...>) {
    const double times[] = {t + Tableau::c[First + i] * h...};
    system.foresee(times, sizeof...(i));
    (run_stage<Tableau, First + i>(system, times[i], y, h, K, stage), ...);
  }(std::make_integer_sequence<int, Last - First + 1>());
}

} // namespace ffrobot
