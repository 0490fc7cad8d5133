// Inward and outward over all bodies.
#pragma once

#include "core/recursion/planar/pins.h"
#include "core/recursion/release.h"
#include "core/recursion/rows.h"

namespace ffrobot::recursion {

// Everything inward: C M^-1 C^T of the active rows, and what they measure
template <class Space, class T, int W>
FFROBOT_INLINE void sweep_inward(const Mechanism<Space> &m, const T *q, const T *v, const Forces<T> &forces,
                                 Workspace<Space, T> &w, Schur<T, W> &S, Pack<T, W> &gamma) {
  if (!forces.is_placed) {
    kinematics(m, q, v, forces, w);
    if (m.needs_positions)
      locate(m, q, w);
  }
  gamma = Pack<T, W>::zero();
  for (int r = 0; r < W; ++r)
    S[r] = Pack<T, W>::zero();
  attach_all<Space, T, W>(m, forces, w, S);
  for (std::size_t i = w.hinges.size(); i-- > 0;) {
    if constexpr (Space::dim == 3)
      if (m.nodes[i].is_pin) {
        inward_pin<T, W>(m, i, q, v, forces, w, S, gamma);
        continue;
      }
    inward<Space, T, W>(m, m.nodes[i], q, v, forces, w, S, gamma);
  }
}

template <bool by_multipliers, class Space, class T, int W>
FFROBOT_INLINE void release_all(const Mechanism<Space> &m, const T *q, const Pack<T, W> &y, Workspace<Space, T> &w,
                                T *a) {
  for (std::size_t i = 0; i < w.hinges.size(); ++i) {
    if constexpr (Space::dim == 3)
      if (m.nodes[i].is_pin) {
        release_pin<by_multipliers, T, W>(m, i, q, w, y, a);
        continue;
      }
    release<Space, T, W>(m, m.nodes[i], q, by_multipliers, w, y, a);
  }
}

// Both of the most columns, once for all who ask
template <class Space, class T>
FFROBOT_APART void sweep_block(const Mechanism<Space> &m, const T *q, const T *v, const Forces<T> &forces,
                               Workspace<Space, T> &w, Schur<T, most_columns> &S, Pack<T, most_columns> &gamma) {
  sweep_inward<Space, T, most_columns>(m, q, v, forces, w, S, gamma);
}
template <bool by_multipliers, class Space, class T>
FFROBOT_APART void release_block(const Mechanism<Space> &m, const T *q, const Pack<T, most_columns> &y,
                                 Workspace<Space, T> &w, T *a) {
  release_all<by_multipliers, Space, T, most_columns>(m, q, y, w, a);
}

// Of coordinates that rows prescribe: exactly what these say. Where a light link carries a heavy one, multipliers leave
// them more rounding than the tolerance of a step at rest has room for.
template <class Space, class T>
void prescribe(const Mechanism<Space> &m, const T *target, const Workspace<Space, T> &w, T *a) {
  for (const int r : w.active)
    if (const Row &row = m.rows[static_cast<std::size_t>(r)]; row.model.kind == RowKind::coordinate)
      a[m.nodes[static_cast<std::size_t>(row.node)].v + row.freedom] = target[r];
}

} // namespace ffrobot::recursion
