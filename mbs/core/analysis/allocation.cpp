#include "core/analysis/allocation.h"

#include "core/linear/small_product.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace ffrobot {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double vanishing = 1e-12;      // eigenvalues of the Hessian below this fraction of the largest are zeros
constexpr double ridge = 1e-9;           // of the smallest other one is added then: picks one of many solutions
constexpr double smallest_ridge = 1e-13; // of the largest
constexpr double rounding = 1e-14;       // of the gradient, relative to its terms
constexpr int most_changes = 500;

} // namespace

Allocation::Allocation(MatrixXd Phi, const MatrixXd &W_sqrt, MatrixXd gain, VectorXd limit, VectorXd scale)
    : Phi_(std::move(Phi)), gain_(std::move(gain)), limit_(std::move(limit)), scale_(std::move(scale)) {
  const Index k = Phi_.cols();
  const MatrixXd A = W_sqrt * Phi_ * scale_.asDiagonal();
  H_ = A.transpose() * A;
  const VectorXd sizes = Eigen::SelfAdjointEigenSolver<MatrixXd>(H_, Eigen::EigenvaluesOnly).eigenvalues();
  const double largest = sizes[k - 1];
  double added = 0;
  if (largest == 0)
    added = 1;
  else if (sizes[0] < vanishing * largest)
    added =
        std::max(smallest_ridge * largest,
                 ridge * *std::find_if(sizes.begin(), sizes.end(), [&](double x) { return x >= vanishing * largest; }));
  H_.diagonal().array() += added;
  back_ = A.transpose() * W_sqrt;
  bound_ = limit_.cwiseQuotient(scale_);
  V_ = u_ = b_ = gradient_ = VectorXd::Zero(k);
  held_.assign(static_cast<std::size_t>(k), 0);
}

const VectorXd &Allocation::solve(const Eigen::Ref<const VectorXd> &F) {
  multiply_small(gain_, F.data(), V_.data());
  if ((V_.array().abs() <= limit_.array()).all()) {
    u_ = V_.cwiseQuotient(scale_);
    std::fill(held_.begin(), held_.end(), 0);
    return V_;
  }
  b_.noalias() = back_ * F;
  for (int i = 0; i < most_changes; ++i) {
    ++iterations_;
    if (!move())
      continue;
    if (!release())
      break;
  }
  V_ = u_.cwiseProduct(scale_).cwiseMax(-limit_).cwiseMin(limit_);
  return V_;
}

// To the minimum of the free voltages, or as far as the first limit on the way: that voltage is held, and false
// returned.
bool Allocation::move() {
  minimise();
  double length = 1;
  Index first = -1;
  for (std::size_t f = 0; f < free_.size(); ++f) {
    const Index j = free_[f];
    const double target = target_[static_cast<Index>(f)], way = target - u_[j];
    if (std::abs(target) <= bound_[j])
      continue;
    const double until = std::max(0.0, (std::copysign(bound_[j], target) - u_[j]) / way);
    if (until < length) {
      length = until;
      first = j;
    }
  }
  for (std::size_t f = 0; f < free_.size(); ++f) {
    double &u = u_[free_[f]];
    u = length == 1 ? target_[static_cast<Index>(f)] : u + length * (target_[static_cast<Index>(f)] - u);
  }
  if (first < 0)
    return true;
  held_[static_cast<std::size_t>(first)] = u_[first] > 0 ? 1 : -1;
  u_[first] = std::copysign(bound_[first], u_[first]);
  return false;
}

// Target of the free voltages: from the held ones alone, whatever the iteration came from.
void Allocation::minimise() {
  free_.clear();
  VectorXd held = VectorXd::Zero(u_.size());
  for (Index j = 0; j < u_.size(); ++j)
    if (held_[static_cast<std::size_t>(j)])
      held[j] = u_[j];
    else
      free_.push_back(j);
  const auto count = static_cast<Index>(free_.size());
  if (free_ != factorised_) {
    MatrixXd H_free(count, count);
    for (Index c = 0; c < count; ++c)
      for (Index r = 0; r < count; ++r)
        H_free(r, c) = H_(free_[static_cast<std::size_t>(r)], free_[static_cast<std::size_t>(c)]);
    llt_.compute(H_free);
    factorised_ = free_;
  }
  gradient_.noalias() = b_ - H_ * held;
  target_.resize(count);
  for (Index f = 0; f < count; ++f)
    target_[f] = gradient_[free_[static_cast<std::size_t>(f)]];
  if (count)
    llt_.solveInPlace(target_);
}

// Frees the voltage that presses most against the inner side of its limit; false where none does: the solution.
bool Allocation::release() {
  gradient_.noalias() = H_ * u_ - b_;
  const double size = b_.lpNorm<Eigen::Infinity>() + H_.lpNorm<Eigen::Infinity>() * u_.lpNorm<Eigen::Infinity>();
  double largest = rounding * size;
  Index most = -1;
  for (Index j = 0; j < u_.size(); ++j) {
    const double inward = held_[static_cast<std::size_t>(j)] * gradient_[j];
    if (inward > largest) {
      largest = inward;
      most = j;
    }
  }
  if (most < 0)
    return false;
  held_[static_cast<std::size_t>(most)] = 0;
  return true;
}

} // namespace ffrobot
