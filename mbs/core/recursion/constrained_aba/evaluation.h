// An evaluation from end to end, for one space, one scalar and one number of columns. Included by the .cpp of each
// (space, scalar) alone: two scalars in one translation unit exhaust the compiler's budget for inlining.
#pragma once

#include "core/recursion/constrained_aba/blocks.h"
#include "core/recursion/constrained_aba/loop_joint_forces.h"

#include <numeric>

namespace ffrobot::recursion {

template <class Space, class T, int W>
FFROBOT_NOINLINE void evaluate(const T *q, const T *v, const Forces<T> &forces, bool is_placed, const T *target,
                               Workspace<Space, T> &w, T *a) {
  using Cols = Pack<T, W>;
  Delassus<T, W> S;
  Cols gamma;
  if (!is_placed)
    kinematic_pass(q, v, forces, w);
  if constexpr (W == most_columns)
    backward_pass_of_block(q, v, forces, w, S, gamma);
  else
    backward_pass(q, v, forces, w, S, gamma);
  Cols y = Cols::zero();
  y.set(0, T(1.));
  if constexpr (W > 1) {
    T lambda[W - 1];
    const int rows = w.active.size();
#pragma GCC unroll 8
    for (int r = 1; r < W; ++r)
      if (r <= rows)
        lambda[r - 1] = gamma[r] - S[r][0] - (target[w.active[r - 1]] - w.lift[r - 1]);
      else
        S[r].set(r, T(1.)), lambda[r - 1] = T(0.);
    if (w.keeps_delassus)
      for (int r = 0; r < rows; ++r)
        for (int c = 0; c < rows; ++c)
          w.delassus[r * rows + c] = S[r + 1][c + 1];
    solve_multipliers<T, W>(S.row, lambda, w.factor.data());
#pragma GCC unroll 8
    for (int r = 1; r < W; ++r)
      y.set(r, lambda[r - 1]);
    for (int r = 0; r < rows; ++r)
      w.lambda[w.active[r]] = lambda[r];
  }
  w.target = target;
  if constexpr (W == most_columns)
    acceleration_pass_of_block<false>(q, y, w, a);
  else
    acceleration_pass<false>(q, y, w, a);
  ++w.evaluations;
}

// `call` with the number of columns as a constant
template <class Space, class F> FFROBOT_INLINE void with_columns(int columns, const F &call) {
  switch (columns) {
  case 1:
    return call(std::integral_constant<int, 1>());
  case 3:
    if constexpr (Space::linear == 2)
      return call(std::integral_constant<int, 3>());
    break;
  case 4:
    return call(std::integral_constant<int, 4>());
  case 7:
    return call(std::integral_constant<int, 7>());
  }
  return call(std::integral_constant<int, most_columns>());
}

template <class Space, class T>
FFROBOT_INLINE void evaluate(const T *q, const T *v, const Forces<T> &forces, bool is_placed, const T *target,
                             Workspace<Space, T> &w, T *a) {
  if (!w.blocks.empty())
    return evaluate_in_blocks(q, v, forces, is_placed, target, w, a);
  with_columns<Space>(w.columns, [&](auto W) { evaluate<Space, T, W>(q, v, forces, is_placed, target, w, a); });
}

template <class Space, class T>
void accelerations(const T *q, const T *v, const Forces<T> &forces, const T *target, Workspace<Space, T> &w, T *a) {
  evaluate(q, v, forces, false, target, w, a);
}

template <class Space, class T>
void accelerations(const Placed<Space, T> &at, const std::type_identity_t<T> *wrench, const T *target, T *a) {
  evaluate(at.q, at.v, Forces<T>{at.generalized, wrench}, true, target, at.w, a);
}

// Of constraint equations, those that are active, into w.y
template <class Space, class T> void put_active(const T *of_all, Workspace<Space, T> &w) {
  std::fill(w.y.begin(), w.y.end(), T(0.));
  for (std::size_t r = 0; r < w.active.size(); ++r)
    w.y[r + 1] = of_all[w.active[r]];
}

// What the multipliers in w.y do
template <class Space, class T> void respond(const T *q, Workspace<Space, T> &w, T *dq) {
  if (!w.blocks.empty())
    return accelerate_in_blocks<true>(q, w, dq);
  with_columns<Space>(w.columns, [&](auto W) {
    const auto y = Pack<T, W>::read(w.y.data());
    if constexpr (W == most_columns)
      acceleration_pass_of_block<true>(q, y, w, dq);
    else
      acceleration_pass<true>(q, y, w, dq);
  });
}

template <class Space, class T> void respond(const T *q, const T *lambda, Workspace<Space, T> &w, T *dq) {
  put_active(lambda, w);
  w.target = nullptr;
  respond(q, w, dq);
}

// Parts of a sum that cancel are rounded by other shares each.
template <class Space, class T>
void round_off(const T *q, const std::type_identity_t<T> &relative, Workspace<Space, T> &w, T *dq) {
  constexpr double golden = 0.6180339887498949; // its multiples are spread over [0, 1)
  put_active(w.lambda.data(), w);
  w.y[0] = relative;
  for (std::size_t r = 1; r < w.y.size(); ++r) {
    const double x = golden * static_cast<double>(r);
    w.y[r] *= -(0.5 + x - std::floor(x)) * relative;
  }
  w.target = w.nothing.data();
  respond(q, w, dq);
}

template <class Space, class T> void response(const T *q, const T *residual, Workspace<Space, T> &w, T *dq) {
  put_active(residual, w);
  solve_factorised(w.factor.data(), w.factored(), w.y.data() + 1);
  w.target = nullptr;
  respond(q, w, dq);
}

template <class Space, class T>
Placed<Space, T> place_all(const T *q, const T *v, const std::type_identity_t<T> *generalized, Workspace<Space, T> &w) {
  kinematics(q, v, Forces<T>{generalized, nullptr}, w);
  locate(q, w);
  return {w, q, v, generalized};
}

template <class Space, class T>
Placed<Space, T> measure(const T *q, const T *v, Workspace<Space, T> &w, T *value, T *rate) {
  const Placed<Space, T> at = place_all(q, v, nullptr, w);
  T d[3], d_dot[3]; // between two points, of which several equations in turn are components
  const Constraint *of = nullptr;
  for (std::size_t r = 0; r < w.m.constraints.size(); ++r) {
    const Constraint &constraint = w.m.constraints[r];
    value[r] = rate[r] = T(0.);
    if (constraint.model.kind == ConstraintKind::point) {
      if (!of || !(of->a == constraint.a && of->b == constraint.b)) {
        Pose<T> a, b;
        attachment_motion(constraint.a, w, a), attachment_motion(constraint.b, w, b);
        for (int i = 0; i < 3; ++i)
          d[i] = b.r[i] - a.r[i], d_dot[i] = b.v[i] - a.v[i];
        of = &constraint;
      }
      for (int i = 0; i < 3; ++i)
        value[r] += constraint.model.f[i] * d[i], rate[r] += constraint.model.f[i] * d_dot[i];
    } else if (constraint.model.kind != ConstraintKind::coordinate) {
      ConstraintMotion<T> motion;
      constraint_motion(constraint, w, true, motion);
      value[r] = motion.value, rate[r] = motion.rate;
    }
    if (constraint.node >= 0) {
      const Node<Space> &node = w.m.nodes[constraint.node];
      value[r] += constraint.share * q[node.q + constraint.freedom],
          rate[r] += constraint.share * v[node.v + constraint.freedom];
    }
  }
  return at;
}

template <class Space, class T>
Workspace<Space, T>::Workspace(const Mechanism<Space> &mechanism)
    : m(mechanism), hinges(m.nodes.size()), frames(m.nodes.size()) {
  const int needed = static_cast<int>(m.constraints.size()) + 1;
  columns = *std::find_if(std::begin(column_counts<Space>), std::end(column_counts<Space>) - 1,
                          [&](int c) { return c >= needed; });
  const std::size_t stride = stride_of(columns);
  std::size_t widest = 8, softs = 0;
  for (const Node<Space> &node : m.nodes) {
    bodies.emplace_back(node.body);
    widest = std::max(widest, static_cast<std::size_t>(node.body_width()));
    first_soft.push_back(static_cast<int>(softs));
    softs += node.inboard >= 0 ? 2 * d : 0;
  }
  ports.resize(m.ports);
  turning.resize(m.ground.size());
  cross.resize(m.crosses * d), soft.resize(softs);
  force.assign(m.ports * d * stride + 8, T(0.)), bias = force;
  stored.assign(m.slots * stride + 8, T(0.));
  sine.assign(m.nodes.size() + 4, T(0.)), cosine = sine;
  z.assign(widest, T(0.));
  const std::size_t rows = m.constraints.size(), factored = std::max(rows, static_cast<std::size_t>(columns - 1));
  delassus.assign(rows * rows, T(0.)), factor.assign(factored * factored, T(0.));
  lambda.assign(rows + 1, T(0.)), nothing = lambda, y.assign(std::max(stride, rows + 1), T(0.));
  for (const Constraint &of : m.constraints) {
    lifts.push_back(of.moves || of.follows ? 0 : of.lift);
    coordinates.emplace_back(of.model.kind == ConstraintKind::coordinate ? of.node : -1, of.freedom);
  }
  for (const auto &actions : m.actions) {
    for (const Action &action : actions.list)
      if (action.is_point) {
        point_forces.push_back({point_force.size(), action.constraint, {}});
        std::copy_n(action.force, Space::linear, point_forces.back().force);
      }
    point_force.resize(point_force.size() + Space::linear * stride, T(0.));
  }
  lift.assign(std::max(stride, rows), T(0.));
  std::vector<int> all(rows);
  std::iota(all.begin(), all.end(), 0);
  keep(all);
}

template <class Space, class T> void Workspace<Space, T>::put_in_columns() {
  const std::size_t stride = stride_of(columns);
  std::fill(point_force.begin(), point_force.end(), T(0.));
  for (const PointForce &at : point_forces)
    if (const int c = column[at.constraint]; c > 0 && c < columns)
      for (std::size_t k = 0; k < Space::linear; ++k)
        point_force[at.place + k * stride + c] += T(at.force[k]);
  for (std::size_t k = 0; k < active.size(); ++k)
    lift[k] = T(lifts[active[k]]);
}

template <class Space, class T> void Workspace<Space, T>::keep(std::vector<int> equations) {
  active = std::move(equations);
  column.assign(lambda.size(), 0);
  std::fill(lambda.begin(), lambda.end(), T(0.));
  for (auto &hinge : hinges)
    std::fill(std::begin(hinge.row), std::end(hinge.row), -1);
  for (std::size_t k = 0; k < active.size(); ++k) {
    const std::size_t r = active[k];
    column[r] = static_cast<int>(k) + 1;
    if (const auto [node, freedom] = coordinates[r]; node >= 0)
      hinges[node].row[freedom] = active[k];
  }
  put_in_columns();
  blocks.clear();
  if (active.size() <= block_constraints)
    return;
  for (auto first = active.begin(); first != active.end();) {
    const auto last = first + std::min<std::ptrdiff_t>(block_constraints, active.end() - first);
    blocks.push_back({{first, last}, {}, stored, bias});
    first = last;
  }
}

#define FFROBOT_EVALUATION(Space, T)                                                                                   \
  template struct Workspace<Space, T>;                                                                                 \
  template Placed<Space, T> place_all(const T *, const T *, const T *, Workspace<Space, T> &);                         \
  template void accelerations(const Placed<Space, T> &, const T *, const T *, T *);                                    \
  template void accelerations(const T *, const T *, const Forces<T> &, const T *, Workspace<Space, T> &, T *);         \
  template Placed<Space, T> measure(const T *, const T *, Workspace<Space, T> &, T *, T *);                            \
  template Pose<T> wrench_pose(const Placed<Space, T> &, int);                                                         \
  template void cut_rates(const Placed<Space, T> &, const std::vector<CutJoint> &, T *);                               \
  template void add_along_cuts(const Placed<Space, T> &, const std::vector<CutJoint> &, const T *, T *)

// Of doubles besides
#define FFROBOT_RESPONSES(Space)                                                                                       \
  template void respond(const double *, const double *, Workspace<Space, double> &, double *);                         \
  template void round_off(const double *, const double &, Workspace<Space, double> &, double *);                       \
  template void response(const double *, const double *, Workspace<Space, double> &, double *)

} // namespace ffrobot::recursion
