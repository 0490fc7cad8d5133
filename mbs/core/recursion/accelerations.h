// An evaluation from end to end, for one space, one scalar and one number of columns. Included by the .cpp of each
// (space, scalar) alone: two scalars in one translation unit exhaust the compiler's budget for inlining.
#pragma once

#include "core/recursion/multipliers.h"
#include "core/recursion/planar/pins.h"
#include "core/recursion/release.h"
#include "core/recursion/rows.h"

#include <algorithm>
#include <numeric>

namespace ffrobot::recursion {

template <bool by_multipliers, class Space, class T, int W>
FFROBOT_INLINE void release_all(const Mechanism<Space> &m, const T *q, const Pack<T, W> &y, Workspace<Space, T> &w,
                                T *a) {
  for (const Node<Space> &node : m.nodes) {
    if constexpr (Space::dim == 3)
      if (node.is_pin) {
        release_pin<by_multipliers, T, W>(m, node, q, w, y, a);
        continue;
      }
    release<Space, T, W>(m, node, q, by_multipliers, w, y, a);
  }
}

// Of coordinates that rows prescribe: exactly what these say. Where a light link carries a heavy one, multipliers leave
// them more rounding than the tolerance of a step at rest has room for.
template <class Space, class T>
void prescribe(const Mechanism<Space> &m, const T *target, const Workspace<Space, T> &w, T *a) {
  for (const int r : w.active)
    if (const Row &row = m.rows[static_cast<std::size_t>(r)]; row.model.kind == RowKind::coordinate)
      a[m.nodes[static_cast<std::size_t>(row.node)].v + row.freedom] = target[r];
}

template <class Space, class T, int W>
inline void run(const Mechanism<Space> &m, const T *q, const T *v, const Forces<T> &forces, const T *target,
                Workspace<Space, T> &w, T *a) {
  using Cols = Pack<T, W>;
  constexpr int stride = stride_of(W);
  if (!forces.is_placed) {
    kinematics(m, q, v, forces, w);
    if (m.needs_positions)
      locate(m, q, w);
  }
  Cols S[W], gamma = Cols::zero();
  for (int r = 0; r < W; ++r)
    S[r] = Cols::zero();
  attach_all<Space, T, W>(m, forces, w, S);
  for (auto node = m.nodes.rbegin(); node != m.nodes.rend(); ++node) {
    if constexpr (Space::dim == 3)
      if (node->is_pin) {
        inward_pin<T, W>(m, *node, q, v, forces, w, S, gamma);
        continue;
      }
    inward<Space, T, W>(m, *node, q, v, forces, w, S, gamma);
  }
  Cols y = Cols::zero();
  y.set(0, T(1.));
  if constexpr (W > 1) {
    T lambda[W - 1];
    const int rows = static_cast<int>(w.active.size());
#pragma GCC unroll 8
    for (int r = 1; r < W; ++r)
      if (r <= rows)
        lambda[r - 1] = gamma[r] - S[r][0] - target[w.active[r - 1]];
      else
        S[r].set(r, T(1.)), lambda[r - 1] = T(0.);
    if (w.keeps_schur)
      for (int r = 0; r < W; ++r)
        S[r].write(w.schur.data() + r * stride);
    solve_multipliers<T, W>(S, lambda, w.factor.data());
#pragma GCC unroll 8
    for (int r = 1; r < W; ++r)
      y.set(r, lambda[r - 1]);
    for (int r = 0; r < rows; ++r)
      w.lambda[w.active[r]] = lambda[r];
  }
  release_all<false, Space, T, W>(m, q, y, w, a);
  if constexpr (W > 1)
    prescribe(m, target, w, a);
  ++w.evaluations;
}

// `call` with the number of columns as a constant
template <class Space, class T, class F> FFROBOT_INLINE void with_columns(int columns, const F &call) {
  if constexpr (std::is_same_v<T, double>)
    switch (columns) {
    case 1:
      return call(std::integral_constant<int, 1>());
    case Space::linear + 1:
      return call(std::integral_constant<int, Space::linear + 1>());
    case 7:
      return call(std::integral_constant<int, 7>());
    }
  return call(std::integral_constant<int, most_columns>());
}

template <class Space, class T>
void accelerations(const Mechanism<Space> &m, const T *q, const T *v, const Forces<T> &forces, const T *target,
                   Workspace<Space, T> &w, T *a) {
  with_columns<Space, T>(w.columns, [&](auto W) { run<Space, T, W>(m, q, v, forces, target, w, a); });
}

template <class Space, class T>
void response(const Mechanism<Space> &m, const T *q, const T *residual, Workspace<Space, T> &w, T *dq) {
  const int count = w.columns - 1;
  for (int r = 0; r <= count; ++r)
    w.y[r] = T(0.);
  for (std::size_t r = 0; r < w.active.size(); ++r)
    w.y[r + 1] = residual[w.active[r]];
  solve_again(w.factor.data(), count, w.y.data() + 1);
  with_columns<Space, T>(w.columns,
                         [&](auto W) { release_all<true, Space, T, W>(m, q, Pack<T, W>::read(w.y.data()), w, dq); });
}

template <class Space, class T>
void place_all(const Mechanism<Space> &m, const T *q, const T *v, const Forces<T> &forces, Workspace<Space, T> &w) {
  kinematics(m, q, v, forces, w);
  locate(m, q, w);
}

template <class Space, class T>
void measure(const Mechanism<Space> &m, const T *q, const T *v, Workspace<Space, T> &w, T *value, T *rate) {
  place_all(m, q, v, Forces<T>(), w);
  for (std::size_t r = 0; r < m.rows.size(); ++r) {
    const Row &row = m.rows[r];
    if (row.model.kind == RowKind::coordinate) {
      const Node<Space> &node = m.nodes[row.node];
      value[r] = q[node.q + row.freedom], rate[r] = v[node.v + row.freedom];
      continue;
    }
    RowMotion<T> motion;
    row_motion(m, row, w, true, motion);
    value[r] = motion.value, rate[r] = motion.rate;
  }
}

template <class Space, class T>
Workspace<Space, T>::Workspace(const Mechanism<Space> &m) : hinges(m.nodes.size()), frames(m.nodes.size()) {
  const int needed = static_cast<int>(m.rows.size()) + 1;
  columns = most_columns;
  if constexpr (std::is_same_v<T, double>)
    columns = *std::find_if(std::begin(column_counts<Space>), std::end(column_counts<Space>) - 1,
                            [&](int c) { return c >= needed; });
  if (m.rows.size() > static_cast<std::size_t>(most_rows))
    throw std::invalid_argument("rows: expected at most " + std::to_string(most_rows) + ", got " +
                                std::to_string(m.rows.size()));
  const auto stride = static_cast<std::size_t>(stride_of(columns));
  std::size_t widest = 8, softs = 0;
  for (const Node<Space> &node : m.nodes) {
    bodies.emplace_back(node.body);
    widest = std::max(widest, static_cast<std::size_t>(node.body_width()));
    first_soft.push_back(static_cast<int>(softs));
    softs += node.inboard >= 0 ? 2 * d : 0;
  }
  ports.resize(static_cast<std::size_t>(m.ports));
  turning.resize(m.ground.size());
  cross.resize(static_cast<std::size_t>(m.crosses) * d), soft.resize(softs);
  force.assign(static_cast<std::size_t>(m.ports) * d * stride + 8, T(0.)), bias = force;
  answer.assign(static_cast<std::size_t>(m.slots) * stride + 8, T(0.));
  angle.assign(m.nodes.size() + 4, T(0.)), sine = cosine = angle;
  z.assign(widest, T(0.));
  schur.assign(stride * stride, T(0.)), factor = schur;
  lambda.assign(m.rows.size() + 1, T(0.)), y.assign(stride, T(0.));
  std::vector<int> all(m.rows.size());
  std::iota(all.begin(), all.end(), 0);
  keep(all);
  for (std::size_t i = 0; i < m.nodes.size(); ++i) {
    auto &hinge = hinges[i];
    for (int k = 0; k < d; ++k) {
      hinge.c[k] = hinge.A[k] = T(0.);
      hinge.Lambda[k] = hinge.U[k] = Pack<T, d>::zero();
      std::fill(std::begin(hinge.column[k]), std::end(hinge.column[k]), T(0.));
    }
    for (int k = 0; k < Space::linear; ++k)
      hinge.r[k] = hinge.r_dot[k] = T(0.);
  }
}

template <class Space, class T> void Workspace<Space, T>::keep(std::vector<int> rows) {
  active = std::move(rows);
  column.assign(lambda.size(), 0);
  std::fill(lambda.begin(), lambda.end(), T(0.));
  for (std::size_t k = 0; k < active.size(); ++k)
    column[static_cast<std::size_t>(active[k])] = static_cast<int>(k) + 1;
}

} // namespace ffrobot::recursion
