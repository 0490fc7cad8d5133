#include "core/integrate/rounding.h"

#include <limits>
#include <random>

namespace ffrobot {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

constexpr double notable = 0.1;                                         // of the error
constexpr double rounding = 2 * std::numeric_limits<double>::epsilon(); // of an entry, relative, after some sums
constexpr double reach = 100; // roundings that entries are shifted by at most: so many that no two shifts are equal

// Entries shifted each by another amount: springs between angles that are equal are to notice. Evenly spread sequences
// will not do: their members nearly agree at some distances.
VectorXd shifted(const double *z, Index n) {
  std::minstd_rand random;
  std::uniform_real_distribution<double> share(-1, 1);
  VectorXd moved(n);
  for (Index i = 0; i < n; ++i)
    moved[i] = z[i] * (1 + reach * rounding * share(random));
  return moved;
}

} // namespace

VectorXd rounding_error(OdeSystem &system, double t, const double *z, const double *z_dot, double step,
                        const VectorXd &error) {
  const Index n = system.size();
  VectorXd left(n);
  system.slope(t, shifted(z, n).data(), left.data());
  left = step / reach * (left - Eigen::Map<const VectorXd>(z_dot, n));
  left.head(n / 2) += step * left.tail(n / 2); // a coordinate, by its rate
  const double rate = 1 / step;
  if (!(system.change_size(z, left.data(), rate) > notable * system.change_size(z, error.data(), rate)))
    left.setZero();
  return left;
}

} // namespace ffrobot
