#include "core/dop853.h"

#include <cmath>
#include <utility>

namespace ffrobot {

namespace tableau = dop853_tableau;
using Eigen::Index;

namespace {

// sum of coefficient[j] * K_j[i] over the nonzero coefficients, all of them known to the compiler
template <const auto &Coefficients, std::size_t... j>
double combine(const double *K, Index n, Index i, std::index_sequence<j...>) {
  const auto term = [&]<std::size_t J>() {
    if constexpr (Coefficients[J] != 0)
      return Coefficients[J] * K[static_cast<Index>(J) * n + i];
    else
      return 0.0;
  };
  return (term.template operator()<j>() + ...);
}

template <const auto &Coefficients, int Count>
void advance(const double *K, Index n, double h, const double *y, double *__restrict out) {
  for (Index i = 0; i < n; ++i)
    out[i] = y[i] + h * combine<Coefficients>(K, n, i, std::make_index_sequence<Count>());
}

template <int Stage>
void run_stage(OdeSystem &system, double t, const double *y, double h, Eigen::MatrixXd &K, Eigen::VectorXd &stage) {
  static constexpr auto &row = tableau::a[Stage];
  advance<row, Stage>(K.data(), K.rows(), h, y, stage.data());
  system.slope(t + tableau::c[Stage] * h, stage.data(), K.col(Stage).data());
}

template <int First, std::size_t... i>
void run_stages(OdeSystem &system, double t, const double *y, double h, Eigen::MatrixXd &K, Eigen::VectorXd &stage,
                std::index_sequence<i...>) {
  (run_stage<First + static_cast<int>(i)>(system, t, y, h, K, stage), ...);
}

} // namespace

Dop853::Dop853(Index size)
    : n_(size), K_(Eigen::MatrixXd::Zero(size, tableau::dense_stages)), stage_(size), end_(size), start_(size),
      F_(size, tableau::dense_order) {}

void Dop853::step(OdeSystem &system, double t, const double *y, double h) {
  run_stages<1>(system, t, y, h, K_, stage_, std::make_index_sequence<tableau::stages - 1>());
  advance<tableau::b, tableau::stages>(K_.data(), n_, h, y, end_.data());
}

double Dop853::estimate(double h, Eigen::VectorXd &error) {
  double square5 = 0, square3 = 0;
  for (Index i = 0; i < n_; ++i) {
    const double e5 = combine<tableau::e5>(K_.data(), n_, i, std::make_index_sequence<tableau::stages + 1>());
    const double e3 = combine<tableau::e3>(K_.data(), n_, i, std::make_index_sequence<tableau::stages + 1>());
    error[i] = h * e5;
    square5 += e5 * e5;
    square3 += e3 * e3;
  }
  const double denominator = square5 + 0.01 * square3;
  return denominator > 0 ? std::sqrt(square5 / denominator) : (denominator == 0 ? 1.0 : NAN);
}

void Dop853::prepare_dense(OdeSystem &system, double t, const double *y, double h) {
  run_stages<tableau::stages + 1>(system, t, y, h, K_, stage_,
                                  std::make_index_sequence<tableau::dense_stages - tableau::stages - 1>());
  t0_ = t;
  h_ = h;
  start_ = Eigen::Map<const Eigen::VectorXd>(y, n_);
  F_.col(0) = end_ - start_;
  F_.col(1) = h * K_.col(0) - F_.col(0);
  F_.col(2) = 2 * F_.col(0) - h * (K_.col(tableau::stages) + K_.col(0));
  for (Index row = 0; row < 4; ++row) {
    F_.col(3 + row).setZero();
    for (Index j = 0; j < tableau::dense_stages; ++j)
      F_.col(3 + row) += (h * tableau::d[row][j]) * K_.col(j);
  }
}

void Dop853::interpolate(double t, double *y) const {
  const double x = (t - t0_) / h_;
  Eigen::Map<Eigen::VectorXd> out(y, n_);
  out = x * F_.col(tableau::dense_order - 1);
  for (int i = tableau::dense_order - 2; i >= 0; --i)
    out = (i % 2 == 0 ? x : 1 - x) * (out + F_.col(i));
  out += start_;
}

} // namespace ffrobot
