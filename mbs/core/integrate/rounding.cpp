#include "core/integrate/rounding.h"

#include <algorithm>
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
constexpr double many = 100; // roundings that entries are shifted by at most: so many that no two shifts are equal

} // namespace

// Entries are shifted each by another amount: springs between angles that are equal are to notice. Evenly spread
// sequences will not do: their members nearly agree at some distances.
Rounding::Rounding(OdeSystem &system)
    : system_(system), shift_(system.size()), shifted_(system.size()), left_(system.size()), found_(system.size()) {
  std::minstd_rand random;
  std::uniform_real_distribution<double> share(-1, 1);
  for (double &of_entry : shift_)
    of_entry = rounding * share(random);
}

const VectorXd &Rounding::error(double t, const double *z, const double *z_dot, double step, Method &method,
                                const VectorXd &error, int &without_look) {
  left_.setZero();
  if (without_look > 0) {
    --without_look;
    return left_;
  }
  const Index n = system_.size();
  double largest = 0;
  const auto take_larger = [&] {
    method.slopes_to_error(step, found_);
    const double size = system_.change_size(z, found_.data(), 1 / step);
    if (size > largest)
      largest = size, left_.swap(found_);
  };
  system_.round_off(method.end(), rounding, found_.data());
  take_larger();
  for (const double reach : {many, 1.0}) {
    shifted_ = Eigen::Map<const VectorXd>(z, n).array() * (1 + reach * shift_);
    system_.slope(t, shifted_.data(), found_.data());
    found_ = (found_ - Eigen::Map<const VectorXd>(z_dot, n)) / reach;
    take_larger();
  }
  const double whole = system_.change_size(z, error.data(), 1 / step);
  if (largest < far * whole)
    without_look = next_steps;
  if (!(largest > notable * whole))
    left_.setZero();
  return left_;
}

} // namespace ffrobot
