// The outboard subtree of a port as a stiffness: Y = (Lambda^-1 + G)^-1, Lambda of the child's joint in its section's
// axes.
#pragma once

#include "core/recursion/constrained_aba/joint_elimination.h"

namespace ffrobot::recursion {

// What is left of a diagonal of Lambda by rounding where the body has no inertia there, of that diagonal
constexpr double no_inertia = 1e-13;

// Columns C of forces (port axes) and numbers D with Lambda = sum of D c c^T, `rank` of them; fewer where the subtree
// there has no inertia in some direction (a point mass, a thin rod): its row and column in Lambda are zero by then.
template <class Space, class T>
FFROBOT_NOINLINE int factors(const Node<Space> &child, const Hinge<Space, T> &hinge, Pack<T, Space::dim> *C, T *D) {
  constexpr int d = Space::dim;
  int kept[d], count = 0, rank = 0;
  const bool full = child.rotor_inertia > 0;
  for (int i = 0, k = 0; i < d; ++i)
    if (!full && k < child.shape.freedoms.count && child.shape.freedoms.component[k] == i)
      ++k;
    else
      kept[count++] = i;
  T L[d][d];
  for (int j = 0; j < count; ++j) { // column j of Lambda becomes column `rank` of L
    for (int i = j; i < count; ++i)
      L[i][rank] = hinge.Lambda[kept[i]][kept[j]];
    const T whole = L[j][rank];
    for (int k = 0; k < rank; ++k) {
      const T x = L[j][k] * D[k];
      for (int i = j; i < count; ++i)
        L[i][rank] -= L[i][k] * x;
    }
    if (value_of(L[j][rank]) <= no_inertia * value_of(whole))
      continue;
    D[rank] = L[j][rank];
    const T inverse = T(1.) / D[rank];
    for (int i = j + 1; i < count; ++i)
      L[i][rank] *= inverse;
    L[j][rank] = T(1.);
    for (int i = 0; i < j; ++i)
      L[i][rank] = T(0.);
    ++rank;
  }
  for (int j = 0; j < rank; ++j) {
    T c[d], turned[d];
    for (int i = 0; i < d; ++i)
      c[i] = T(0.);
    for (int i = 0; i < count; ++i)
      c[kept[i]] = L[i][j];
    forces_by_freedoms<-1>(child, hinge, c);
    Space::template Turn<T>::add_moment(hinge.r, c);
    hinge.turn.apply(c, turned);
    C[j] = Pack<T, d>::zero(); // lanes beyond d are summed up, too
    for (int i = 0; i < d; ++i)
      C[j].set(i, turned[i]);
  }
  return rank;
}

// Y = C (1/D + C^T G C)^-1 C^T: sums of positive terms
template <int d, class T>
FFROBOT_NOINLINE void stiffness(int rank, Pack<T, d> *C, const T *D, const Pack<T, d> *G, bool is_flexible,
                                Pack<T, d> *Y) {
  for (int i = 0; i < d; ++i)
    Y[i] = Pack<T, d>::zero();
  if (!is_flexible) {
    for (int j = 0; j < rank; ++j) {
      const Pack<T, d> x = D[j] * C[j];
      for (int i = 0; i < d; ++i)
        Y[i] += C[j][i] * x;
    }
    return;
  }
  T N[d][d], N_inverse[d];
  for (int i = 0; i < rank; ++i) {
    Pack<T, d> GC = C[i][0] * G[0];
    for (int k = 1; k < d; ++k)
      GC += C[i][k] * G[k];
    for (int j = 0; j <= i; ++j)
      N[i][j] = (GC * C[j]).sum();
    N[i][i] += T(1.) / D[i];
  }
  for (int j = 0; j < rank; ++j) { // C becomes L^-1 C^T
    N_inverse[j] = T(1.) / N[j][j];
    for (int i = j + 1; i < rank; ++i) {
      const T x = N[i][j] * N_inverse[j];
      for (int k = j + 1; k <= i; ++k)
        N[i][k] -= x * N[k][j];
      C[i] -= x * C[j];
    }
  }
  for (int j = 0; j < rank; ++j) {
    const Pack<T, d> x = N_inverse[j] * C[j];
    for (int i = 0; i < d; ++i)
      Y[i] += C[j][i] * x;
  }
}

// Y = X Lambda X^T, X the columns of forces: of a port that no mode moves
template <class Space, class T>
FFROBOT_INLINE void turned_stiffness(const Hinge<Space, T> &hinge, Pack<T, Space::dim> *Y) {
  constexpr int d = Space::dim;
  using MatrixRow = Pack<T, d>;
  MatrixRow Z[d]; // Lambda X^T
  for (int i = 0; i < d; ++i) {
    Z[i] = hinge.Lambda[i][0] * MatrixRow::read(hinge.column[0]);
    for (int j = 1; j < d; ++j)
      Z[i] += hinge.Lambda[i][j] * MatrixRow::read(hinge.column[j]);
  }
  Space::template Turn<T>::add_moment(hinge.r, Z);
  hinge.turn.apply(Z, Y);
}

// Y = C (1/D + C^T G C)^-1 C^T with Lambda = L D L^T, C = X L, where the last d - rank freedoms alone are free: sums of
// positive terms
template <int rank, int d, class T, class H>
FFROBOT_INLINE void series_stiffness(const H &hinge, const Pack<T, d> *G, Pack<T, d> *Y) {
  using MatrixRow = Pack<T, d>;
  MatrixRow C[rank];
  MatrixRow products[rank * (rank + 1) / 2]; // of N's lower half, row after row
  T M[rank][rank], N[rank][rank], lower[rank * (rank + 1) / 2], D_inverse[rank];
#pragma GCC unroll 6
  for (int i = 0; i < rank; ++i)
#pragma GCC unroll 6
    for (int j = 0; j <= i; ++j)
      M[i][j] = hinge.Lambda[i][j];
#pragma GCC unroll 6
  for (int j = 0; j < rank; ++j) { // number by number: what each step waits for is short
    D_inverse[j] = T(1.) / M[j][j];
    C[j] = MatrixRow::read(hinge.column[j]);
#pragma GCC unroll 6
    for (int i = j + 1; i < rank; ++i) {
      const T L_ij = M[i][j] * D_inverse[j];
#pragma GCC unroll 6
      for (int k = j + 1; k <= i; ++k)
        M[i][k] -= L_ij * M[k][j];
      C[j] += L_ij * MatrixRow::read(hinge.column[i]);
    }
  }
#pragma GCC unroll 6
  for (int i = 0; i < rank; ++i) {
    MatrixRow GC = C[i][0] * G[0];
#pragma GCC unroll 6
    for (int k = 1; k < d; ++k)
      GC += C[i][k] * G[k];
#pragma GCC unroll 6
    for (int j = 0; j <= i; ++j)
      products[i * (i + 1) / 2 + j] = GC * C[j];
  }
  sums(products, lower);
#pragma GCC unroll 6
  for (int i = 0; i < rank; ++i) {
#pragma GCC unroll 6
    for (int j = 0; j <= i; ++j)
      N[i][j] = lower[i * (i + 1) / 2 + j];
    N[i][i] += D_inverse[i];
  }
#pragma GCC unroll 6
  for (int i = 0; i < d; ++i)
    Y[i] = MatrixRow::zero();
#pragma GCC unroll 6
  for (int j = 0; j < rank; ++j) { // C becomes L^-1 C^T
    const T inverse = T(1.) / N[j][j];
#pragma GCC unroll 6
    for (int i = j + 1; i < rank; ++i) {
      const T x = N[i][j] * inverse;
#pragma GCC unroll 6
      for (int k = j + 1; k <= i; ++k)
        N[i][k] -= x * N[k][j];
      C[i] -= x * C[j];
    }
    const MatrixRow x = inverse * C[j];
#pragma GCC unroll 6
    for (int i = 0; i < d; ++i)
      Y[i] += C[j][i] * x;
  }
}

// Y of the outboard subtree of a port
template <class Space, class T>
FFROBOT_NOINLINE void subtree_inertia(const Node<Space> &child, const Hinge<Space, T> &hinge, bool is_flexible,
                                      const Pack<T, Space::dim> *G, Pack<T, Space::dim> *Y) {
  constexpr int d = Space::dim;
  if (child.is_weightless) { // a joint takes the one inertia that there is
    for (int i = 0; i < d; ++i)
      Y[i] = Pack<T, d>::zero();
    return;
  }
  if (!is_flexible && child.shape.free_are_axes)
    return turned_stiffness(hinge, Y);
  if constexpr (d == 6 && std::is_same_v<T, double>)
    if (child.joint == JointKind::revolute)
      return child.rotor_inertia > 0 ? series_stiffness<d, d, T>(hinge, G, Y)
                                     : series_stiffness<d - 1, d, T>(hinge, G, Y);
  Pack<T, d> C[d];
  T D[d];
  const int rank = factors<Space, T>(child, hinge, C, D);
  stiffness<d, T>(rank, C, D, G, is_flexible, Y);
}

} // namespace ffrobot::recursion
