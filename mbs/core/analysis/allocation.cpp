#include "core/analysis/allocation.h"

#include "core/linear/dense.h"
#include "core/linear/small_product.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

namespace ffrobot {

namespace {

constexpr double vanishing = 1e-12;      // eigenvalues of A^T A below this fraction of the largest are zeros
constexpr double ridge = 1e-9;           // of the smallest other one is added then: picks one of many solutions
constexpr double smallest_ridge = 1e-13; // of the largest
constexpr double rounding = 1e-15;       // of the gradient, relative to its terms

} // namespace

Allocation::Allocation(MatrixXd Phi, const MatrixXd &W_sqrt, MatrixXd gain, VectorXd lower, VectorXd upper,
                       VectorXd scale)
    : Phi_(std::move(Phi)), gain_(std::move(gain)), lower_(std::move(lower)), upper_(std::move(upper)),
      scale_(std::move(scale)) {
  const Index k = Phi_.cols();
  const MatrixXd A = W_sqrt * Phi_ * scale_.asDiagonal();
  const VectorXd values = RightVectors(A).values;
  VectorXd sizes = VectorXd::Zero(k); // eigenvalues of A^T A, ascending
  sizes.tail(values.size()) = values.reverse().cwiseAbs2();
  const double largest = sizes[k - 1];
  double added = 0;
  if (largest == 0)
    added = 1;
  else if (sizes[0] < vanishing * largest)
    added =
        std::max(smallest_ridge * largest,
                 ridge * *std::find_if(sizes.begin(), sizes.end(), [&](double x) { return x >= vanishing * largest; }));
  A_ = MatrixXd::Zero(A.rows() + k, k);
  A_.topRows(A.rows()) = A;
  A_.bottomRows(k).diagonal().setConstant(std::sqrt(added));
  W_sqrt_ = W_sqrt;
  d_ = left_ = VectorXd::Zero(A_.rows());
  V_ = u_ = gradient_ = VectorXd::Zero(k);
  held_.assign(k, 0);
}

const VectorXd &Allocation::solve(const Ref<const VectorXd> &F) {
  multiply_small(gain_, F.data(), V_.data());
  if ((V_.array() >= lower_.array()).all() && (V_.array() <= upper_.array()).all()) {
    u_ = V_.cwiseQuotient(scale_);
    std::fill(held_.begin(), held_.end(), 0);
    return V_;
  }
  d_.head(W_sqrt_.rows()).noalias() = W_sqrt_ * F;
  const Index most_changes = 500 + 20 * u_.size();
  for (Index i = 0; i < most_changes; ++i) {
    ++iterations_;
    if (!move())
      continue;
    if (!release()) {
      V_ = u_.cwiseProduct(scale_).cwiseMax(lower_).cwiseMin(upper_);
      return V_;
    }
  }
  throw std::runtime_error("voltages within limits: expected the best within " + std::to_string(most_changes) +
                           " changes of those at a limit, found none");
}

// To the minimum of the free voltages, or as far as the first limit on the way: that voltage is held, and false
// returned.
bool Allocation::move() {
  minimise();
  double length = 1;
  Index first = -1;
  int side = 0;
  for (std::size_t f = 0; f < free_.size(); ++f) {
    const Index j = free_[f];
    const double target = target_[f], way = target - u_[j];
    if (std::abs(target) <= std::abs(bound(j, target)))
      continue;
    const double until = std::max(0.0, (bound(j, target) - u_[j]) / way);
    if (until < length) {
      length = until;
      first = j;
      side = target > 0 ? 1 : -1;
    }
  }
  for (std::size_t f = 0; f < free_.size(); ++f) {
    double &u = u_[free_[f]];
    u = length == 1 ? target_[f] : u + length * (target_[f] - u);
  }
  if (first < 0)
    return true;
  held_[first] = side;
  u_[first] = bound(first, side);
  return false;
}

// Target of the free voltages: from the held ones alone, whatever the iteration came from.
void Allocation::minimise() {
  free_.clear();
  VectorXd held = VectorXd::Zero(u_.size());
  for (Index j = 0; j < u_.size(); ++j)
    if (held_[j])
      held[j] = u_[j];
    else
      free_.push_back(j);
  const Index count = free_.size();
  if (free_ != factorised_) {
    qr_.compute(A_(Eigen::all, free_));
    factorised_ = free_;
  }
  left_ = d_;
  left_.noalias() -= A_ * held;
  target_ = count ? VectorXd(qr_.solve(left_)) : VectorXd();
}

// Frees the voltage that presses most against the inner side of its limit; false where none does: the solution.
bool Allocation::release() {
  left_ = d_;
  left_.noalias() -= A_ * u_;
  gradient_.noalias() = -A_.transpose() * left_;
  double largest = rounding * A_.norm() * (d_.norm() + A_.norm() * u_.norm());
  Index most = -1;
  for (Index j = 0; j < u_.size(); ++j) {
    const double inward = held_[j] * gradient_[j];
    if (inward > largest) {
      largest = inward;
      most = j;
    }
  }
  if (most < 0)
    return false;
  held_[most] = 0;
  return true;
}

} // namespace ffrobot
