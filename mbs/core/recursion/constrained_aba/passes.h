// The three passes over all bodies: kinematics outward, elimination inward, accelerations outward.
#pragma once

#include "core/recursion/constrained_aba/constraints.h"
#include "core/recursion/constrained_aba/pin_joints.h"

namespace ffrobot::recursion {

template <class Space, class T>
FFROBOT_INLINE void kinematic_pass(const T *q, const T *v, const Forces<T> &forces, Workspace<Space, T> &w) {
  kinematics(q, v, forces, w);
  if (w.m.needs_positions)
    locate(q, w);
}

// C M^-1 C^T of the active constraint equations, and what they measure
template <class Space, class T, int W>
FFROBOT_INLINE void backward_pass(const T *q, const T *v, const Forces<T> &forces, Workspace<Space, T> &w,
                                  Delassus<T, W> &S, Pack<T, W> &gamma) {
  gamma = Pack<T, W>::zero();
  for (int r = 0; r < W; ++r)
    S[r] = Pack<T, W>::zero();
  act_on_ports(forces, w, S);
  for (std::size_t i = w.hinges.size(); i-- > 0;) {
    if constexpr (Space::dim == 3)
      if (w.m.nodes[i].is_pin) {
        eliminate_pin(i, q, v, forces, w, S, gamma);
        continue;
      }
    eliminate_body(w.m.nodes[i], q, v, forces, w, S, gamma);
  }
}

template <bool by_multipliers, class Space, class T, int W>
FFROBOT_INLINE void acceleration_pass(const T *q, const Pack<T, W> &y, Workspace<Space, T> &w, T *a) {
  for (std::size_t i = 0; i < w.hinges.size(); ++i) {
    if constexpr (Space::dim == 3)
      if (w.m.nodes[i].is_pin) {
        accelerate_pin<by_multipliers>(i, q, w, y, a);
        continue;
      }
    accelerate_body(w.m.nodes[i], q, by_multipliers, w, y, a);
  }
}

// The last two of the most columns, once for all who ask
template <class Space, class T>
FFROBOT_NOINLINE void backward_pass_of_block(const T *q, const T *v, const Forces<T> &forces, Workspace<Space, T> &w,
                                             Delassus<T, most_columns> &S, Pack<T, most_columns> &gamma) {
  backward_pass(q, v, forces, w, S, gamma);
}
template <bool by_multipliers, class Space, class T>
FFROBOT_NOINLINE void acceleration_pass_of_block(const T *q, const Pack<T, most_columns> &y, Workspace<Space, T> &w,
                                                 T *a) {
  acceleration_pass<by_multipliers>(q, y, w, a);
}

} // namespace ffrobot::recursion
