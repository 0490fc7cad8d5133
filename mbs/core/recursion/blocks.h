// Evaluations with more rows than there are columns: in blocks of rows, one sweep inward for each.
//
// What a_i b_i^T are added up to C M^-1 C^T is the same in all sweeps but for the rows, so that products between blocks
// are made of a_i of one and b_i of another. Outward, the answers of all columns times their multipliers are one
// column, the first.
#pragma once

#include "core/recursion/multipliers.h"
#include "core/recursion/sweeps.h"

namespace ffrobot::recursion {

// Rows of a block in the place of all active ones, and back
template <class Space, class T> void exchange_rows(Workspace<Space, T> &w, Block<T> &block) {
  for (const int r : w.active)
    w.column[r] = 0;
  w.active.swap(block.rows);
  for (std::size_t k = 0; k < w.active.size(); ++k)
    w.column[w.active[k]] = static_cast<int>(k) + 1;
  w.put_in_columns();
}

// Lower half of the part of C M^-1 C^T, (n, n), of rows of one block, from `first` on, by those of one before it
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
  for (int r = first; r < std::min(n, first + block_rows); ++r)
    for (int c = 0; c < block_rows; ++c)
      S[r * n + first_before + c] = sum[r - first + 1][c + 1];
}

// Answers and biases of ports by y, of column 0 times `unit`, to the first column of the workspace
template <class Space, class T> void add_up(Workspace<Space, T> &w, const T &unit) {
  constexpr int stride = stride_of(most_columns);
  using Cols = Pack<T, most_columns>;
  for (const auto &[to, from] : {std::pair(&w.answer, &Block<T>::answer), {&w.bias, &Block<T>::bias}})
    for (std::size_t i = 0; i + stride <= to->size(); i += stride) {
      T sum = unit * (w.blocks[0].*from)[i];
      const T *y = w.y.data() + 1;
      for (const Block<T> &block : w.blocks)
        for (std::size_t r = 0; r < block.rows.size(); ++r)
          sum += (block.*from)[i + r + 1] * *y++;
      Cols all = Cols::zero();
      all.set(0, sum);
      all.write(to->data() + i);
    }
}

template <bool by_multipliers, class Space, class T>
void release_blocks(const Mechanism<Space> &m, const T *q, Workspace<Space, T> &w, T *a) {
  add_up(w, T(by_multipliers ? 0. : 1.));
  auto y = Pack<T, most_columns>::zero();
  y.set(0, T(1.));
  release_block<by_multipliers>(m, q, y, w, a);
}

template <class Space, class T>
void run_in_blocks(const Mechanism<Space> &m, const T *q, const T *v, const Forces<T> &forces, const T *target,
                   Workspace<Space, T> &w, T *a) {
  const int n = static_cast<int>(w.active.size());
  T *S_all = w.factor.data(), *lambda = w.y.data() + 1;
  Schur<T, most_columns> S;
  Pack<T, most_columns> gamma;
  Forces<T> acting = forces;
  int first = 0;
  for (Block<T> &block : w.blocks) {
    block.terms.clear();
    S.terms = &block.terms;
    exchange_rows(w, block);
    sweep_block(m, q, v, acting, w, S, gamma);
    acting.is_placed = false; // that of the first block alone
    const int count = static_cast<int>(w.active.size());
    for (int r = 0; r < count; ++r) {
      lambda[first + r] = gamma[r + 1] - S[r + 1][0] - (target[w.active[r]] - w.lift[r]);
      for (int c = 0; c <= r; ++c)
        S_all[(first + r) * n + first + c] = S[r + 1][c + 1];
    }
    exchange_rows(w, block);
    w.answer.swap(block.answer), w.bias.swap(block.bias);
    for (int before = 0; before < first; before += block_rows)
      multiply_blocks(block.terms, first, w.blocks[before / block_rows].terms, before, n, S_all);
    first += count;
  }
  if (w.keeps_schur)
    for (int r = 0; r < n; ++r)
      for (int c = 0; c <= r; ++c)
        w.schur[r * n + c] = w.schur[c * n + r] = S_all[r * n + c];
  factorise(S_all, n), solve_again(S_all, n, lambda);
  for (int r = 0; r < n; ++r)
    w.lambda[w.active[r]] = lambda[r];
  release_blocks<false>(m, q, w, a);
  prescribe(m, target, w, a);
  ++w.evaluations;
}

} // namespace ffrobot::recursion
