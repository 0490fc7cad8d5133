#include "core/allocation.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace ffrobot {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double ridge = 1e-8; // of the Hessian's largest eigenvalue, where others vanish: picks one of many solutions
constexpr double vanishing = 1e-12;
constexpr int most_iterations = 200, most_halvings = 40, refinements = 2;

} // namespace

Allocation::Allocation(MatrixXd Phi, const MatrixXd &W_sqrt, MatrixXd gain, VectorXd limit, VectorXd scale)
    : Phi_(std::move(Phi)), gain_(std::move(gain)), limit_(std::move(limit)), scale_(std::move(scale)) {
  const Index k = Phi_.cols();
  const MatrixXd A = W_sqrt * Phi_ * scale_.asDiagonal();
  H_ = A.transpose() * A;
  const VectorXd sizes = Eigen::SelfAdjointEigenSolver<MatrixXd>(H_, Eigen::EigenvaluesOnly).eigenvalues();
  if (sizes[0] < vanishing * sizes[k - 1] || sizes[k - 1] == 0)
    ridge_ = sizes[k - 1] > 0 ? ridge * sizes[k - 1] : 1.0;
  H_.diagonal().array() += ridge_;
  back_ = A.transpose() * W_sqrt;
  bound_ = limit_.cwiseQuotient(scale_);
  V_ = u_ = b_ = gradient_ = trial_ = VectorXd::Zero(k);
}

const VectorXd &Allocation::solve(const Eigen::Ref<const VectorXd> &F) {
  V_.noalias() = gain_ * F;
  if ((V_.array().abs() <= limit_.array()).all()) {
    u_ = V_.cwiseQuotient(scale_);
    return V_;
  }
  b_.noalias() = back_ * F;
  bool exact = false; // the last step ended at the minimum of the free voltages
  for (int i = 0; i < most_iterations; ++i) {
    gradient_.noalias() = H_ * u_ - b_;
    const bool same = hold();
    if (free_.empty() || (exact && same))
      break;
    ++iterations_;
    exact = step();
  }
  finish();
  V_ = u_.cwiseProduct(scale_).cwiseMax(-limit_).cwiseMin(limit_);
  return V_;
}

void Allocation::finish() {
  if (free_.empty())
    return;
  for (const Index f : free_)
    u_[f] = 0;
  for (int i = 0; i <= (ridge_ > 0 ? refinements : 0); ++i) {
    gradient_.noalias() = H_ * u_ - b_;
    if (i > 0)
      gradient_ -= ridge_ * u_;
    solve_free();
    for (std::size_t f = 0; f < free_.size(); ++f)
      u_[free_[f]] += free_step_[static_cast<Index>(f)];
  }
  u_ = u_.cwiseMax(-bound_).cwiseMin(bound_);
}

bool Allocation::hold() {
  free_.clear();
  for (Index i = 0; i < u_.size(); ++i) {
    const bool held = (u_[i] >= bound_[i] && gradient_[i] < 0) || (u_[i] <= -bound_[i] && gradient_[i] > 0);
    if (!held)
      free_.push_back(i);
  }
  if (free_ == factorised_)
    return true;
  factorised_ = free_;
  if (free_.empty())
    return false;
  const auto count = static_cast<Index>(free_.size());
  MatrixXd H_free(count, count);
  for (Index c = 0; c < count; ++c)
    for (Index r = 0; r < count; ++r)
      H_free(r, c) = H_(free_[static_cast<std::size_t>(r)], free_[static_cast<std::size_t>(c)]);
  llt_.compute(H_free);
  return false;
}

void Allocation::solve_free() {
  const auto count = static_cast<Index>(free_.size());
  free_step_.resize(count);
  for (Index f = 0; f < count; ++f)
    free_step_[f] = -gradient_[free_[static_cast<std::size_t>(f)]];
  llt_.solveInPlace(free_step_);
}

bool Allocation::step() {
  solve_free();
  const auto count = free_step_.size();
  const double before = cost(u_);
  double length = 1;
  bool cut = false;
  for (int i = 0; i < most_halvings; ++i, length /= 2) {
    trial_ = u_;
    cut = false;
    for (Index f = 0; f < count; ++f) {
      const Index j = free_[static_cast<std::size_t>(f)];
      const double wanted = u_[j] + length * free_step_[f];
      trial_[j] = std::clamp(wanted, -bound_[j], bound_[j]);
      cut = cut || trial_[j] != wanted;
    }
    // sufficient decrease, as far as rounding lets it be seen
    const double promised = gradient_.dot(trial_ - u_);
    if (cost(trial_) <= before + 1e-4 * promised + 1e-15 * std::abs(before))
      break;
  }
  u_ = trial_;
  return length == 1 && !cut;
}

} // namespace ffrobot
