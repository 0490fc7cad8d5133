#include "core/integrate/rounding.h"

#include <limits>
#include <random>

namespace ffrobot {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

constexpr double notable = 0.1;                                         // of the error
constexpr double rounding = 2 * std::numeric_limits<double>::epsilon(); // of an entry, relative, after some sums
constexpr double far = 0.01 * notable;                                  // where it is less, the next steps need no look
constexpr int next_steps = 10;
constexpr double reach = 100; // roundings that entries are shifted by at most: so many that no two shifts are equal

} // namespace

// Entries are shifted each by another amount: springs between angles that are equal are to notice. Evenly spread
// sequences will not do: their members nearly agree at some distances.
Rounding::Rounding(OdeSystem &system)
    : system_(system), shift_(system.size()), shifted_(system.size()), left_(system.size()) {
  std::minstd_rand random;
  std::uniform_real_distribution<double> share(-1, 1);
  for (double &factor : shift_)
    factor = 1 + reach * rounding * share(random);
}

const VectorXd &Rounding::error(double t, const double *z, const double *z_dot, double step, const VectorXd &error) {
  left_.setZero();
  if (resting_ > 0) {
    --resting_;
    return left_;
  }
  const Index n = system_.size();
  shifted_ = Eigen::Map<const VectorXd>(z, n).array() * shift_;
  system_.slope(t, shifted_.data(), left_.data());
  left_ = step / reach * (left_ - Eigen::Map<const VectorXd>(z_dot, n));
  left_.head(n / 2) += step * left_.tail(n / 2); // a coordinate, by its rate
  const double rate = 1 / step, size = system_.change_size(z, left_.data(), rate),
               whole = system_.change_size(z, error.data(), rate);
  if (size < far * whole)
    resting_ = next_steps;
  if (!(size > notable * whole))
    left_.setZero();
  return left_;
}

} // namespace ffrobot
