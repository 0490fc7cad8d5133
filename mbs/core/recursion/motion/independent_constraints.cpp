#include "core/recursion/motion/independent_constraints.h"

#include "core/recursion/motion/natural_sizes.h"
#include "core/recursion/motion/postures.h"

#include <numeric>

namespace ffrobot::recursion {

namespace {

// A constraint counts as dependent below this part of its own mobility: rounding leaves 1e-13, a badly placed
// constraint 1e-7.
constexpr double dependent = 1e-10;

// Nothing moves a constraint whose mobility is below this part of the largest, or whose squared gradient is below this
// part of the largest and of 1: rounding leaves 1e-30 of gradients. Mobilities of constraints across the plane of a
// mechanism are rounding of the elimination, which may be more.
constexpr double immobile = 1e-24;

// Both in natural sizes. The most mobile come first: of those that depend on them, multipliers would be larger.
std::vector<int> pivots(MatrixXd S, const VectorXd &squares, std::size_t most) {
  const VectorXd own = S.diagonal();
  const double largest = own.maxCoeff(), smallest = immobile * std::max(1., squares.maxCoeff());
  std::vector<int> left(S.rows()), kept;
  std::iota(left.begin(), left.end(), 0);
  const auto depends = [&](int i) {
    return !(S(i, i) > std::max(dependent * own[i], immobile * largest) && squares[i] > smallest);
  };
  while (std::erase_if(left, depends), !left.empty() && kept.size() < most) {
    const auto best = std::max_element(left.begin(), left.end(), [&](int i, int j) { return S(i, i) < S(j, j); });
    const int k = *best;
    kept.push_back(k), left.erase(best);
    for (const int i : left)
      for (const int j : left)
        S(i, j) -= S(i, k) * S(k, j) / S(k, k);
  }
  std::sort(kept.begin(), kept.end());
  return kept;
}

} // namespace

template <class Space>
void keep_independent_constraints(const double *q, const double *v, Workspace<Space, double> &w, std::size_t most) {
  const Index count = w.m.constraints.size();
  std::vector<int> all(w.m.constraints.size());
  std::iota(all.begin(), all.end(), 0);
  w.keep(all);
  if (count == 0)
    return;
  const NaturalSizes sizes(w.m);
  const VectorXd squares = sizes.of_gradients(gradients(q, w)).rowwise().squaredNorm();
  const std::vector<double> target(w.m.constraints.size(), 0.0);
  std::vector<double> a(w.m.n_v);
  w.keeps_delassus = true;
  accelerations(q, v, Forces<double>(), target.data(), w, a.data());
  w.keeps_delassus = false;
  const MatrixXd S = Map<const MatrixXd>(w.delassus.data(), count, count);
  w.keep(pivots(sizes.of_rows().asDiagonal() * S * sizes.of_rows().asDiagonal(), squares, most));
}

template void keep_independent_constraints(const double *, const double *, Workspace<Planar, double> &, std::size_t);
template void keep_independent_constraints(const double *, const double *, Workspace<Spatial, double> &, std::size_t);

} // namespace ffrobot::recursion
