// Evaluations with more constraint equations than there are columns: in blocks of these, a backward pass for each.
//
// What a_i b_i^T are added up to C M^-1 C^T is the same in all passes but for the equations, so that products between
// blocks are made of a_i of one and b_i of another. In the acceleration pass all columns times their multipliers are
// one column, the first.
#pragma once

#include "core/recursion/constrained_aba/passes.h"

namespace ffrobot::recursion {

// Equations of a block in the place of all active ones, and back
template <class Space, class T> void exchange_constraints(Workspace<Space, T> &w, Block<T> &block) {
  for (const int r : w.active)
    w.column[r] = 0;
  w.active.swap(block.equations);
  for (std::size_t k = 0; k < w.active.size(); ++k)
    w.column[w.active[k]] = static_cast<int>(k) + 1;
  w.put_in_columns();
}

// Lower half of the part of C M^-1 C^T, (n, n), of one block, from `first` on, by one before it
template <class T>
void multiply_blocks(const Terms<T> &rows, int first, const Terms<T> &before, int first_before, int n, T *S) {
  using Cols = Pack<T, most_columns>;
  Cols sum[most_columns];
  for (Cols &row : sum)
    row = Cols::zero();
  for (std::size_t i = 0; i < rows.a.size(); i += most_columns) {
    const Cols b = Cols::read(before.b.data() + i);
    for (int r = 1; r < most_columns; ++r)
      sum[r] += rows.a[i + r] * b;
  }
  for (int r = first; r < std::min(n, first + block_constraints); ++r)
    for (int c = 0; c < block_constraints; ++c)
      S[r * n + first_before + c] = sum[r - first + 1][c + 1];
}

// Stored columns and biases of ports by y, of column 0 times `unit`, to the first column of the workspace
template <class Space, class T> void add_up(Workspace<Space, T> &w, const T &unit) {
  constexpr int stride = stride_of(most_columns);
  using Cols = Pack<T, most_columns>;
  for (const auto &[to, from] : {std::pair(&w.stored, &Block<T>::stored), {&w.bias, &Block<T>::bias}})
    for (std::size_t i = 0; i + stride <= to->size(); i += stride) {
      T sum = unit * (w.blocks[0].*from)[i];
      const T *y = w.y.data() + 1;
      for (const Block<T> &block : w.blocks)
        for (std::size_t r = 0; r < block.equations.size(); ++r)
          sum += (block.*from)[i + r + 1] * *y++;
      Cols all = Cols::zero();
      all.set(0, sum);
      all.write(to->data() + i);
    }
}

template <bool by_multipliers, class Space, class T>
void accelerate_in_blocks(const T *q, Workspace<Space, T> &w, T *a) {
  add_up(w, by_multipliers ? w.y[0] : T(1.));
  auto y = Pack<T, most_columns>::zero();
  y.set(0, T(1.));
  acceleration_pass_of_block<by_multipliers>(q, y, w, a);
}

template <class Space, class T>
void evaluate_in_blocks(const T *q, const T *v, const Forces<T> &forces, bool is_placed, const T *target,
                        Workspace<Space, T> &w, T *a) {
  const int n = w.active.size();
  T *S_all = w.factor.data(), *lambda = w.y.data() + 1;
  Delassus<T, most_columns> S;
  Pack<T, most_columns> gamma;
  int first = 0;
  for (Block<T> &block : w.blocks) {
    block.terms.clear();
    S.terms = &block.terms;
    exchange_constraints(w, block);
    if (!is_placed || first > 0) // the backward pass leaves kinematics of some bodies changed
      kinematic_pass(q, v, forces, w);
    backward_pass_of_block(q, v, forces, w, S, gamma);
    const int count = w.active.size();
    for (int r = 0; r < count; ++r) {
      lambda[first + r] = gamma[r + 1] - S[r + 1][0] - (target[w.active[r]] - w.lift[r]);
      for (int c = 0; c <= r; ++c)
        S_all[(first + r) * n + first + c] = S[r + 1][c + 1];
    }
    exchange_constraints(w, block);
    w.stored.swap(block.stored), w.bias.swap(block.bias);
    for (int before = 0; before < first; before += block_constraints)
      multiply_blocks(block.terms, first, w.blocks[before / block_constraints].terms, before, n, S_all);
    first += count;
  }
  if (w.keeps_delassus)
    for (int r = 0; r < n; ++r)
      for (int c = 0; c <= r; ++c)
        w.delassus[r * n + c] = w.delassus[c * n + r] = S_all[r * n + c];
  factorise(S_all, n), solve_factorised(S_all, n, lambda);
  for (int r = 0; r < n; ++r)
    w.lambda[w.active[r]] = lambda[r];
  w.target = target;
  accelerate_in_blocks<false>(q, w, a);
  ++w.evaluations;
}

} // namespace ffrobot::recursion
