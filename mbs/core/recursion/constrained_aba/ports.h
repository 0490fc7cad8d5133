// Inward over the ports of a body: their outboard subtrees, by elimination of the body's modes.
#pragma once

#include "core/recursion/constrained_aba/subtree_inertia.h"

namespace ffrobot::recursion {

// The block of forces on port b by accelerations of port a, a < b, of a node with n ports
constexpr int cross_index(int a, int b, int n) { return a * n - a * (a + 1) / 2 + b - a - 1; }

// Port k of a body with several is eliminated: its force acts on the ports after it.
template <class Space, class T, int W>
inline void spread_to_later_ports(const Node<Space> &node, int k, bool loaded, const Pack<T, W> *F,
                                  Workspace<Space, T> &w) {
  constexpr int d = Space::dim, stride = stride_of(W);
  using MatrixRow = Pack<T, d>;
  using Cols = Pack<T, W>;
  const int n = node.ports();
  const PortWork<Space, T> &port = w.ports[node.first_port + k];
  const auto cross = [&](int a, int b) { return w.cross.data() + (node.first_cross + cross_index(a, b, n)) * d; };
  for (int l = k + 1; l < n; ++l) {
    if (!node.body.ports[k].is_flexible || !node.body.ports[l].is_flexible)
      continue;
    PortWork<Space, T> &later = w.ports[node.first_port + l];
    const MatrixRow *K = cross(k, l); // rows of port k by columns of port l
    T *bias = w.bias.data() + (node.first_port + l) * d * stride;
    MatrixRow YX[d], YK[d];
    if (loaded)
      for (int i = 0; i < d; ++i) {
        YX[i] = port.Y[i][0] * port.X[0], YK[i] = port.Y[i][0] * K[0];
        for (int j = 1; j < d; ++j)
          YX[i] += port.Y[i][j] * port.X[j], YK[i] += port.Y[i][j] * K[j];
      }
    for (int r = 0; r < d; ++r) {
      Cols B = Cols::read(bias + r * stride);
      for (int i = 0; i < d; ++i) {
        const T factor = K[i][r];
        B -= factor * F[i];
        if (loaded)
          later.X[r] -= factor * YX[i], later.G[r] -= factor * YK[i];
      }
      B.write(bias + r * stride);
    }
    if (loaded)
      for (int o = l + 1; o < n; ++o)
        if (node.body.ports[o].is_flexible) {
          MatrixRow *between = cross(l, o);
          const MatrixRow *other = cross(k, o);
          for (int i = 0; i < d; ++i) {
            MatrixRow Y_other = port.Y[i][0] * other[0];
            for (int j = 1; j < d; ++j)
              Y_other += port.Y[i][j] * other[j];
            for (int r = 0; r < d; ++r)
              between[r] -= K[i][r] * Y_other;
          }
        }
  }
}

// H += X^T F, M += X^T YX, row by row
template <int d, class T, int W>
FFROBOT_INLINE void gain_by_transpose(const Pack<T, d> *X, const Pack<T, W> *F, const Pack<T, d> *YX, Pack<T, W> *H,
                                      Pack<T, d> *M) {
  const auto add_dyad = [&](int r) {
    Pack<T, W> h = H[r];
    Pack<T, d> m = M[r];
    for (int i = 0; i < d; ++i) {
      const T x = X[i][r];
      h += x * F[i], m += x * YX[i];
    }
    H[r] = h, M[r] = m;
  };
  if constexpr (std::is_same_v<T, double> && W <= 8) { // else it would be much code
#pragma GCC unroll 6
    for (int r = 0; r < d; ++r)
      add_dyad(r);
  } else
    for (int r = 0; r < d; ++r)
      add_dyad(r);
}

// X, beta and G of all ports; where there are several, beta as columns and what is between them
template <class Space, class T, int W>
FFROBOT_INLINE void prepare_ports(const Node<Space> &node, Workspace<Space, T> &w) {
  constexpr int d = Space::dim, stride = stride_of(W);
  const int n = node.ports();
  auto &state = w.bodies[node.index];
  for (int k = 0; k < n; ++k) {
    PortWork<Space, T> &port = w.ports[node.first_port + k];
    port_rows(node.body, k, state, port.X, port.beta, port.G);
    if (n == 1)
      return;
    T *bias = w.bias.data() + (node.first_port + k) * d * stride;
    for (int i = 0; i < d; ++i) {
      auto B = Pack<T, W>::zero();
      B.set(0, port.beta[i]);
      B.write(bias + i * stride);
    }
    for (int l = k + 1; l < n; ++l)
      if (node.body.ports[k].is_flexible && node.body.ports[l].is_flexible)
        port_gram(node.body, state, k, l, w.cross.data() + (node.first_cross + cross_index(k, l, n)) * d);
  }
}

// Forces F of a port, P where the body gives way alone: F = P + Y (B - G P), B its bias. With D = B - G P what
// constraints measure of it is -(D^T F + P^T B), where B has no column but that of the forces -(D^T F) and beta^T P of
// gamma.
template <class Space, class T, int W>
FFROBOT_INLINE void answer_of_port(PortWork<Space, T> &port, bool is_flexible, bool loaded, const T *bias,
                                   Pack<T, W> *F, Delassus<T, W> &S, Pack<T, W> &gamma) {
  constexpr int d = Space::dim, stride = stride_of(W);
  using Cols = Pack<T, W>;
  if (bias)
    for (int i = 0; i < d; ++i)
      subtract_dyad(S, F[i], Cols::read(bias + i * stride));
  else if (W > 1)
    for (int i = 0; i < d; ++i)
      gamma += port.beta[i] * F[i];
  if (!is_flexible && !bias) {
    if (loaded) {
      const auto Y_beta = symmetric_product(port.Y, port.beta);
      for (int i = 0; i < d; ++i)
        F[i].add(0, Y_beta[i]);
    }
    return;
  }
  Cols D[d];
  for (int i = 0; i < d; ++i) {
    if (bias)
      D[i] = Cols::read(bias + i * stride);
    else
      D[i] = Cols::zero(), D[i].set(0, port.beta[i]);
    if (is_flexible)
      for (int j = 0; j < d; ++j)
        D[i] -= port.G[i][j] * F[j];
  }
  if (loaded)
    for (int i = 0; i < d; ++i)
      for (int j = 0; j < d; ++j)
        F[i] += port.Y[i][j] * D[j];
  if (W > 1)
    subtract_dyads(S, D, F);
}

// Ports of the body, one after the other: M, H, S and gamma gain their outboard subtrees.
template <class Space, class T, int W>
inline void eliminate_ports(const Node<Space> &node, Workspace<Space, T> &w, Pack<T, Space::dim> *M, Pack<T, W> *H,
                            Delassus<T, W> &S, Pack<T, W> &gamma) {
  constexpr int d = Space::dim, stride = stride_of(W);
  using Cols = Pack<T, W>;
  const bool several = node.ports() > 1;
  prepare_ports<Space, T, W>(node, w);
  for (int k = 0; k < node.outboard; ++k) {
    const int index = node.first_port + k;
    PortWork<Space, T> &port = w.ports[index];
    const bool is_flexible = node.body.ports[k].is_flexible;
    const int child = w.m.children[index];
    const bool loaded = child >= 0;
    if (loaded)
      subtree_inertia(w.m.nodes[child], w.hinges[child], is_flexible, port.G, port.Y);
    Cols F[d];
    const T *P = w.force.data() + index * d * stride;
    for (int i = 0; i < d; ++i)
      F[i] = Cols::read(P + i * stride);
    answer_of_port(port, is_flexible, loaded, several ? w.bias.data() + index * d * stride : nullptr, F, S, gamma);
    T *answer = w.stored.data() + node.port_slot(k) * stride;
    for (int i = 0; i < d; ++i)
      F[i].write(answer + i * stride);
    if (loaded) {
      Pack<T, d> YX[d];
      apply(port.Y, port.X, YX);
      gain_by_transpose(port.X, F, YX, H, M);
    } else
      for (int i = 0; i < d; ++i)
        for (int r = 0; r < d; ++r)
          H[r] += port.X[i][r] * F[i];
    if (several)
      spread_to_later_ports(node, k, loaded, F, w);
  }
}

// From the frame to the section that the joint holds, where modes move it: the inboard port is the last one, and force
// and acceleration change their parts. f = N^-1 (A_section - B'), N = X M^-1 X^T + G, B' = B - X M^-1 H.
template <class Space, class T, int W>
inline void move_to_section(const Node<Space> &node, Workspace<Space, T> &w, Pack<T, Space::dim> *M, Pack<T, W> *H,
                            Delassus<T, W> &S) {
  constexpr int d = Space::dim, stride = stride_of(W);
  using MatrixRow = Pack<T, d>;
  using Cols = Pack<T, W>;
  const int index = node.first_port + node.inboard;
  PortWork<Space, T> &port = w.ports[index];
  MatrixRow *R = w.soft.data() + w.first_soft[node.index]; // M^-1 X^T
  invert(M);
  for (int i = 0; i < d; ++i) {
    T row[d];
    for (int r = 0; r < d; ++r)
      row[r] = (M[i] * port.X[r]).sum();
    for (int r = 0; r < d; ++r)
      R[i].set(r, row[r]);
  }
  MatrixRow N[d];
  for (int r = 0; r < d; ++r) {
    N[r] = port.G[r];
    for (int i = 0; i < d; ++i)
      N[r] += port.X[r][i] * R[i];
  }
  invert(N);
  Cols MH[d], B[d], Pi[d];
  apply(M, H, MH);
  for (int r = 0; r < d; ++r) {
    if (node.ports() > 1)
      B[r] = Cols::read(w.bias.data() + (index * d + r) * stride);
    else
      B[r] = Cols::zero(), B[r].set(0, port.beta[r]);
    for (int i = 0; i < d; ++i)
      B[r] -= port.X[r][i] * MH[i];
  }
  apply(N, B, Pi);
  const auto tilt = inboard_tilt(node, w.bodies[node.index]);
  for (int i = 0; i < d; ++i) {
    Pi[i] = T(-1.) * Pi[i];
    if (W > 1)
      add_dyad(S, H[i], MH[i]), add_dyad(S, B[i], Pi[i]);
    MH[i].write(w.stored.data() + (node.inboard_slot() + i) * stride);
    Pi[i].write(w.stored.data() + (node.inboard_slot() + d + i) * stride);
    R[d + i] = N[i];
  }
  // N turned into axes of the section: Q^T N Q
  MatrixRow half[d];
  for (int i = 0; i < d; ++i) {
    T x[d], y[d];
    for (int j = 0; j < d; ++j)
      x[j] = N[i][j];
    tilt.back(x, y);
    half[i] = MatrixRow::zero();
    for (int j = 0; j < d; ++j)
      half[i].set(j, y[j]);
  }
  tilt.back(half, M);
  tilt.back(Pi, H);
}

} // namespace ffrobot::recursion
