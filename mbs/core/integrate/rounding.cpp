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
    : system_(system), shift_(system.size()), shifted_(system.size()), left_(system.size()), larger_(system.size()) {
  std::minstd_rand random;
  std::uniform_real_distribution<double> share(-1, 1);
  for (double &of_entry : shift_)
    of_entry = rounding * share(random);
}

double Rounding::look(double t, const double *z, const double *z_dot, double step, Method &method, double reach) {
  const Index n = system_.size();
  shifted_ = Eigen::Map<const VectorXd>(z, n).array() * (1 + reach * shift_);
  system_.slope(t, shifted_.data(), left_.data());
  left_ = (left_ - Eigen::Map<const VectorXd>(z_dot, n)) / reach;
  method.slopes_to_error(step, left_);
  return system_.change_size(z, left_.data(), 1 / step);
}

const VectorXd &Rounding::error(double t, const double *z, const double *z_dot, double step, Method &method,
                                const VectorXd &error, int &without_look) {
  left_.setZero();
  if (without_look > 0) {
    --without_look;
    return left_;
  }
  const double of_states = look(t, z, z_dot, step, method, many);
  larger_.swap(left_);
  const double of_forces = look(t, z, z_dot, step, method, 1);
  if (!(of_forces > of_states))
    larger_.swap(left_);
  const double size = std::max(of_states, of_forces), whole = system_.change_size(z, error.data(), 1 / step);
  if (size < far * whole)
    without_look = next_steps;
  if (!(size > notable * whole))
    left_.setZero();
  return left_;
}

} // namespace ffrobot
