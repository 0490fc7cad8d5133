#include "core/allocation.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace ffrobot {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double ridge = 1e-12;     // of the Hessian's trace: picks one of many solutions, shifts none that is unique
constexpr double tolerance = 1e-11; // of the gradient, relative to its terms
constexpr int most_iterations = 200, most_halvings = 40;

} // namespace

Allocation::Allocation(MatrixXd Phi, const MatrixXd &W_sqrt, MatrixXd gain, VectorXd limit)
    : Phi_(std::move(Phi)), gain_(std::move(gain)), limit_(std::move(limit)), scale_(limit_) {
  const Index k = Phi_.cols();
  for (Index i = 0; i < k; ++i)
    if (!std::isfinite(scale_[i]))
      scale_[i] = 1;
  const MatrixXd A = W_sqrt * Phi_ * scale_.asDiagonal();
  H_ = A.transpose() * A;
  H_.diagonal().array() += ridge * std::max(H_.trace(), std::numeric_limits<double>::min());
  back_ = A.transpose() * W_sqrt;
  V_ = u_ = b_ = gradient_ = trial_ = free_step_ = VectorXd::Zero(k);
}

const VectorXd &Allocation::solve(const Eigen::Ref<const VectorXd> &F) {
  V_.noalias() = gain_ * F;
  const VectorXd bound = limit_.cwiseQuotient(scale_); // 1, or infinite
  if ((V_.array().abs() <= limit_.array()).all()) {
    u_ = V_.cwiseQuotient(scale_);
    return V_;
  }
  b_.noalias() = back_ * F;
  for (int i = 0; i < most_iterations; ++i) {
    ++iterations_;
    gradient_.noalias() = H_ * u_ - b_;
    hold();
    double largest = 0;
    for (const Index f : free_)
      largest = std::max(largest, std::abs(gradient_[f]));
    const double size = b_.lpNorm<Eigen::Infinity>() + H_.diagonal().maxCoeff() * u_.lpNorm<Eigen::Infinity>();
    if (largest <= tolerance * size)
      break;
    step();
  }
  V_ = u_.cwiseProduct(scale_).cwiseMax(-limit_).cwiseMin(limit_);
  return V_;
}

void Allocation::hold() {
  free_.clear();
  for (Index i = 0; i < u_.size(); ++i) {
    const double bound = limit_[i] / scale_[i];
    const bool held = (u_[i] >= bound && gradient_[i] < 0) || (u_[i] <= -bound && gradient_[i] > 0);
    if (!held)
      free_.push_back(i);
  }
  if (free_ == factorised_ || free_.empty())
    return;
  const auto count = static_cast<Index>(free_.size());
  MatrixXd H_free(count, count);
  for (Index c = 0; c < count; ++c)
    for (Index r = 0; r < count; ++r)
      H_free(r, c) = H_(free_[static_cast<std::size_t>(r)], free_[static_cast<std::size_t>(c)]);
  llt_.compute(H_free);
  factorised_ = free_;
}

void Allocation::step() {
  const auto count = static_cast<Index>(free_.size());
  free_step_.resize(count);
  for (Index f = 0; f < count; ++f)
    free_step_[f] = -gradient_[free_[static_cast<std::size_t>(f)]];
  llt_.solveInPlace(free_step_);
  const double before = cost(u_);
  double length = 1;
  for (int i = 0; i < most_halvings; ++i, length /= 2) {
    trial_ = u_;
    for (Index f = 0; f < count; ++f) {
      const Index j = free_[static_cast<std::size_t>(f)];
      const double bound = limit_[j] / scale_[j];
      trial_[j] = std::clamp(u_[j] + length * free_step_[f], -bound, bound);
    }
    // sufficient decrease, as far as rounding lets it be seen
    const double promised = gradient_.dot(trial_ - u_);
    if (cost(trial_) <= before + 1e-4 * promised + 1e-15 * std::abs(before))
      break;
  }
  u_ = trial_;
}

} // namespace ffrobot
