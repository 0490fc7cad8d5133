#include "core/recursion/constrained_aba/derivatives.h"

#include "core/recursion/numbers/dual.h"
#include "core/space/configuration_space.h"

#include <algorithm>
#include <vector>

namespace ffrobot::recursion {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;

constexpr Index directions = Dual::directions;

using Duals = std::vector<Dual>;

Duals constants(const double *x, std::size_t size) {
  Duals found(size, Dual(0.));
  if (x)
    std::copy_n(x, size, found.begin());
  return found;
}

// Rate 1 in direction k
void seed(Dual &x, Index k, double rate = 1) { x.rate.add(static_cast<int>(k), rate); }

// q is incremented along v[i] in direction k; a quaternion e by e (0, dw)/2 for a rotation vector dw in body axes.
void seed_increment(const ConfigurationSpace &space, const double *q, Index i, Index k, Duals &to) {
  for (const auto &numbers : space.numbers())
    if (i >= numbers.v && i < numbers.v + numbers.count)
      seed(to[numbers.q + i - numbers.v], k);
  for (const auto &rotation : space.rotations()) {
    if (i < rotation.v || i >= rotation.v + 3)
      continue;
    const double *e = q + rotation.q;
    const double change[3][4] = {{-e[1], e[0], e[3], -e[2]}, {-e[2], -e[3], e[0], e[1]}, {-e[3], e[2], -e[1], e[0]}};
    for (Index j = 0; j < 4; ++j)
      seed(to[rotation.q + j], k, 0.5 * change[i - rotation.v][j]);
  }
}

Dual resistance(const Friction &friction, const Dual &rate) {
  return {friction.resistance(rate.value), friction.slope(rate.value) * rate.rate};
}

// Rates of x, in up to eight directions, to columns of `to` from `first` on
template <class Values> void take(const Values &x, Index first, Index count, MatrixXd &to) {
  for (Index j = 0; j < to.rows(); ++j)
    for (Index k = 0; k < count; ++k)
      to(j, first + k) = x[j].rate[static_cast<int>(k)];
}

} // namespace

template <class Space>
Derivatives derivatives(const Mechanism<Space> &m, const Workspace<Space, double> &kept, const double *q,
                        const double *v, const Forces<double> &forces, const AtSections &at, const double *target,
                        bool by_forces) {
  const ConfigurationSpace space(m.n_v, m.rotations);
  const Index n = m.n_v, rows = m.constraints.size();
  const std::size_t n_v = n, n_rows = m.constraints.size();
  Workspace<Space, Dual> w(m);
  w.keep(kept.active), w.turning = kept.turning;
  const Duals q0 = constants(q, m.n_q), v0 = constants(v, n_v);
  const Duals force0 = constants(forces.generalized, n_v), held = constants(target, n_rows);
  const Duals wrench = constants(forces.wrench, Space::dim * m.wrenches.size());
  Duals a(n_v), value(n_rows), rate(n_rows), along(at.joints.size()), acting_wrench;
  const auto answer = [&](const Duals &at_q, const Duals &at_v, const Duals &force) {
    const Placed<Space, Dual> placed = place_all(m, at_q.data(), at_v.data(), force.data(), w);
    acting_wrench = wrench;
    add_at_points(placed, at.points, at.t, at.length, acting_wrench.data());
    cut_rates(placed, at.joints, along.data());
    for (std::size_t k = 0; k < along.size(); ++k)
      along[k] = Dual(at.loads[k]) - resistance(at.joints[k].friction, along[k]);
    add_along_cuts(placed, at.joints, along.data(), acting_wrench.data());
    accelerations(placed, acting_wrench.data(), held.data(), a.data());
  };
  const MatrixXd square(n, n), of_rows(rows, n);
  Derivatives found{square, square, square, of_rows, of_rows, of_rows, of_rows};
  for (Index first = 0; first < n; first += directions) {
    const Index count = std::min(directions, n - first);
    Duals q1 = q0, v1 = v0, force1 = force0;
    for (Index k = 0; k < count; ++k) {
      const std::size_t i = first + k;
      seed_increment(space, q, first + k, k, q1), seed(v1[i], k), seed(force1[i], k);
    }
    answer(q1, v0, force0), take(a, first, count, found.a_q), take(w.lambda, first, count, found.lambda_q);
    answer(q0, v1, force0), take(a, first, count, found.a_v), take(w.lambda, first, count, found.lambda_v);
    if (by_forces)
      answer(q0, v0, force1), take(a, first, count, found.a_f);
    measure(m, q1.data(), v0.data(), w, value.data(), rate.data());
    take(value, first, count, found.value_q), take(rate, first, count, found.rate_q);
  }
  return found;
}

template Derivatives derivatives(const Mechanism<Planar> &, const Workspace<Planar, double> &, const double *,
                                 const double *, const Forces<double> &, const AtSections &, const double *, bool);
template Derivatives derivatives(const Mechanism<Spatial> &, const Workspace<Spatial, double> &, const double *,
                                 const double *, const Forces<double> &, const AtSections &, const double *, bool);

} // namespace ffrobot::recursion
