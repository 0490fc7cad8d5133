// The articulated-body recursion with modes eliminated, for any body and joint. (R. Featherstone, Rigid Body Dynamics
// Algorithms, 2008, ch. 7, without modes.)
//
// Accelerations are classical ones, of a point of the body in axes of the body, and the ground accelerates with -g: no
// velocity but the angular one enters. m: rows of the frame in M, P: rows of a port, M_ff = I:
//     p_ddot = Q_f - m^T A + sum of P^T f        A_port = X A + beta + G f,  X = X_rigid - P m^T,  G = P P^T
// What hangs on the port answers f = -Lambda A_port - pi, so that f = -Y (X A + beta) - E pi with
//     Y = (Lambda^-1 + G)^-1     E = I - Y G     M += X^T Y X     bias += X^T (Y beta + E pi)
// then the joint is eliminated as in any recursion of this kind. Constraint rows are the biases of unit multipliers, in
// columns beside that of the forces (column 0). What is eliminated leaves its part of C M^-1 C^T in S, of which column
// 0 is what the rows measure.
#pragma once

#include "core/recursion/planar/kinematics.h"
#include "core/recursion/spatial/kinematics.h"

namespace ffrobot::recursion {

// How far columns lie apart in memory
constexpr int stride_of(int columns) { return static_cast<int>(std::bit_ceil(static_cast<unsigned>(columns))); }

// Row r of S gains, or loses, a_r b
template <class Cols, int W> FFROBOT_INLINE void gain(Cols (&S)[W], const Cols &a, const Cols &b) {
#pragma GCC unroll 8
  for (int r = 1; r < W; ++r)
    S[r] += a[r] * b;
}
template <class Cols, int W> FFROBOT_INLINE void lose(Cols (&S)[W], const Cols &a, const Cols &b) {
#pragma GCC unroll 8
  for (int r = 1; r < W; ++r)
    S[r] -= a[r] * b;
}

// Columns C of forces (port axes) and numbers D with Lambda = sum of D c c^T, `rank` of them
template <class Space, class T>
FFROBOT_APART int factors(const Node<Space> &child, const Hinge<Space, T> &hinge, Pack<T, Space::dim> *C, T *D) {
  constexpr int d = Space::dim;
  if (child.is_weightless) // a joint takes the one inertia that there is
    return 0;
  int kept[d], rank = 0;
  const bool full = child.rotor_inertia > 0;
  for (int i = 0, k = 0; i < d; ++i)
    if (!full && k < child.shape.freedoms.count && child.shape.freedoms.component[k] == i)
      ++k;
    else
      kept[rank++] = i;
  T L[d][d];
  for (int j = 0; j < rank; ++j) {
    for (int i = j; i < rank; ++i)
      L[i][j] = hinge.Lambda[kept[i]][kept[j]];
    for (int k = 0; k < j; ++k) {
      const T x = L[j][k] * D[k];
      for (int i = j; i < rank; ++i)
        L[i][j] -= L[i][k] * x;
    }
    D[j] = L[j][j];
    const T inverse = T(1.) / D[j];
    for (int i = j + 1; i < rank; ++i)
      L[i][j] *= inverse;
    L[j][j] = T(1.);
  }
  for (int j = 0; j < rank; ++j) {
    T c[d], turned[d];
    for (int i = 0; i < d; ++i)
      c[i] = T(0.);
    for (int i = j; i < rank; ++i)
      c[kept[i]] = L[i][j];
    if (child.joint == JointKind::screw && !full)
      c[d - 1] = -(child.lead * c[2]);
    if (child.joint == JointKind::universal) { // from axes of the cross
      const T c0 = c[0], c3 = c[3];
      c[0] = hinge.cross_cosine * c0 - hinge.cross_sine * c[2],
      c[2] = hinge.cross_sine * c0 + hinge.cross_cosine * c[2];
      c[3] = hinge.cross_cosine * c3 - hinge.cross_sine * c[5],
      c[5] = hinge.cross_sine * c3 + hinge.cross_cosine * c[5];
    }
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
FFROBOT_APART void stiffness(int rank, Pack<T, d> *C, const T *D, const Pack<T, d> *G, bool is_soft, Pack<T, d> *Y) {
  for (int i = 0; i < d; ++i)
    Y[i] = Pack<T, d>::zero();
  if (!is_soft) {
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

// y (Cols) = M x
template <int d, class T, class Cols> FFROBOT_INLINE void apply(const Pack<T, d> *M, const Cols *x, Cols *y) {
  for (int i = 0; i < d; ++i) {
    y[i] = M[i][0] * x[0];
    for (int j = 1; j < d; ++j)
      y[i] += M[i][j] * x[j];
  }
}

// The block of forces on port b by accelerations of port a, a < b, of a node with n ports
constexpr int cross_index(int a, int b, int n) { return a * n - a * (a + 1) / 2 + b - a - 1; }

// Port k of a body with several is eliminated: its force acts on the ports after it.
template <class Space, class T, int W>
inline void spread_to_later_ports(const Node<Space> &node, int k, bool loaded, const Pack<T, W> *F,
                                  Workspace<Space, T> &w) {
  constexpr int d = Space::dim, stride = stride_of(W);
  using Row = Pack<T, d>;
  using Cols = Pack<T, W>;
  const int n = node.ports();
  const PortWork<Space, T> &port = w.ports[node.first_port + k];
  const auto cross = [&](int a, int b) { return w.cross.data() + (node.first_cross + cross_index(a, b, n)) * d; };
  for (int l = k + 1; l < n; ++l) {
    if (!node.body.ports[k].is_soft || !node.body.ports[l].is_soft)
      continue;
    PortWork<Space, T> &later = w.ports[node.first_port + l];
    const Row *K = cross(k, l); // rows of port k by columns of port l
    T *bias = w.bias.data() + (node.first_port + l) * d * stride;
    Row YX[d], YK[d];
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
        if (node.body.ports[o].is_soft) {
          Row *between = cross(l, o);
          const Row *other = cross(k, o);
          for (int i = 0; i < d; ++i) {
            Row Y_other = port.Y[i][0] * other[0];
            for (int j = 1; j < d; ++j)
              Y_other += port.Y[i][j] * other[j];
            for (int r = 0; r < d; ++r)
              between[r] -= K[i][r] * Y_other;
          }
        }
  }
}

// Ports of the body, one after the other: M, H and S gain what hangs there.
template <class Space, class T, int W>
inline void eliminate_ports(const Mechanism<Space> &m, const Node<Space> &node, Workspace<Space, T> &w,
                            Pack<T, Space::dim> *M, Pack<T, W> *H, Pack<T, W> (&S)[W]) {
  constexpr int d = Space::dim, stride = stride_of(W);
  using Cols = Pack<T, W>;
  auto &state = w.bodies[&node - m.nodes.data()];
  const bool several = node.ports() > 1;
  for (int k = 0; k < node.ports(); ++k) {
    PortWork<Space, T> &port = w.ports[node.first_port + k];
    port_rows(node.body, k, state, port.X, port.beta, port.G);
    if (several) {
      T *bias = w.bias.data() + (node.first_port + k) * d * stride;
      for (int i = 0; i < d; ++i) {
        Cols B = Cols::zero();
        B.set(0, port.beta[i]);
        B.write(bias + i * stride);
      }
      for (int l = k + 1; l < node.ports(); ++l)
        if (node.body.ports[k].is_soft && node.body.ports[l].is_soft)
          port_gram(node.body, state, k, l, w.cross.data() + (node.first_cross + cross_index(k, l, node.ports())) * d);
    }
  }
  for (int k = 0; k < node.outboard; ++k) {
    const int index = node.first_port + k;
    PortWork<Space, T> &port = w.ports[index];
    const bool is_soft = node.body.ports[k].is_soft;
    const int child = m.children[index];
    const bool loaded = child >= 0;
    if (loaded) {
      Pack<T, d> C[d];
      T D[d];
      const int rank = factors<Space, T>(m.nodes[child], w.hinges[child], C, D);
      stiffness<d, T>(rank, C, D, port.G, is_soft, port.Y);
    }
    Cols P[d], E[d], F[d];
    for (int i = 0; i < d; ++i)
      E[i] = P[i] = Cols::read(w.force.data() + (index * d + i) * stride);
    if (is_soft) {
      Cols C[d];
      if (loaded) {
        apply<d, T>(port.G, P, C);
        for (int i = 0; i < d; ++i)
          for (int j = 0; j < d; ++j)
            E[i] -= port.Y[i][j] * C[j];
      }
      if (W > 1) {
        apply<d, T>(port.G, E, C);
        for (int i = 0; i < d; ++i)
          gain(S, P[i], C[i]);
      }
    }
    for (int i = 0; i < d; ++i)
      F[i] = E[i];
    if (several) {
      const T *bias = w.bias.data() + index * d * stride;
      Cols B[d];
      for (int i = 0; i < d; ++i)
        B[i] = Cols::read(bias + i * stride);
      if (loaded)
        for (int i = 0; i < d; ++i)
          for (int j = 0; j < d; ++j)
            F[i] += port.Y[i][j] * B[j];
      if (W > 1)
        for (int i = 0; i < d; ++i)
          lose(S, B[i], F[i]), lose(S, E[i], B[i]);
    } else {
      if (W > 1)
        for (int i = 0; i < d; ++i)
          for (int r = 1; r < W; ++r)
            S[r].add(0, -(port.beta[i] * E[i][r]));
      if (loaded) {
        T Y_beta[d];
        multiply<d, T>(port.Y, port.beta, Y_beta);
        for (int i = 0; i < d; ++i)
          F[i].add(0, Y_beta[i]);
      }
    }
    for (int i = 0; i < d; ++i) {
      F[i].write(w.answer.data() + (node.port_slot(k) + i) * stride);
      for (int j = 0; j < d; ++j)
        H[j] += port.X[i][j] * F[i];
    }
    if (loaded)
      for (int i = 0; i < d; ++i) {
        Pack<T, d> YX = port.Y[i][0] * port.X[0];
        for (int j = 1; j < d; ++j)
          YX += port.Y[i][j] * port.X[j];
        for (int r = 0; r < d; ++r)
          M[r] += port.X[i][r] * YX;
      }
    if (several)
      spread_to_later_ports<Space, T, W>(node, k, loaded, F, w);
  }
}

// From the frame to the section that the joint holds, where modes move it: the inboard port is the last one, and force
// and acceleration change their parts. f = N^-1 (A_section - B'), N = X M^-1 X^T + G, B' = B - X M^-1 H.
template <class Space, class T, int W>
inline void move_to_section(const Mechanism<Space> &m, const Node<Space> &node, Workspace<Space, T> &w,
                            Pack<T, Space::dim> *M, Pack<T, W> *H, Pack<T, W> (&S)[W]) {
  constexpr int d = Space::dim, stride = stride_of(W);
  using Row = Pack<T, d>;
  using Cols = Pack<T, W>;
  const auto i_node = &node - m.nodes.data();
  const int index = node.first_port + node.inboard;
  PortWork<Space, T> &port = w.ports[index];
  Row *R = w.soft.data() + w.first_soft[i_node]; // M^-1 X^T
  invert<d, T>(M);
  for (int i = 0; i < d; ++i) {
    T row[d];
    for (int r = 0; r < d; ++r)
      row[r] = (M[i] * port.X[r]).sum();
    for (int r = 0; r < d; ++r)
      R[i].set(r, row[r]);
  }
  Row N[d];
  for (int r = 0; r < d; ++r) {
    N[r] = port.G[r];
    for (int i = 0; i < d; ++i)
      N[r] += port.X[r][i] * R[i];
  }
  invert<d, T>(N);
  Cols MH[d], B[d], Pi[d];
  apply<d, T>(M, H, MH);
  for (int r = 0; r < d; ++r) {
    if (node.ports() > 1)
      B[r] = Cols::read(w.bias.data() + (index * d + r) * stride);
    else
      B[r] = Cols::zero(), B[r].set(0, port.beta[r]);
    for (int i = 0; i < d; ++i)
      B[r] -= port.X[r][i] * MH[i];
  }
  apply<d, T>(N, B, Pi);
  const auto tilt = inboard_tilt(node, w.bodies[i_node]);
  for (int i = 0; i < d; ++i) {
    Pi[i] = T(-1.) * Pi[i];
    if (W > 1)
      gain(S, H[i], MH[i]), gain(S, B[i], Pi[i]);
    MH[i].write(w.answer.data() + (node.inboard_slot() + i) * stride);
    Pi[i].write(w.answer.data() + (node.inboard_slot() + d + i) * stride);
    R[d + i] = N[i];
  }
  // N turned into axes of the section: Q^T N Q
  Row half[d];
  for (int i = 0; i < d; ++i) {
    T x[d], y[d];
    for (int j = 0; j < d; ++j)
      x[j] = N[i][j];
    tilt.back(x, y);
    half[i] = Row::zero();
    for (int j = 0; j < d; ++j)
      half[i].set(j, y[j]);
  }
  tilt.back(half, M);
  tilt.back(Pi, H);
}

// In axes of the cross of a universal joint, and back: x and z turn about y
template <class T, class X> FFROBOT_INLINE void to_cross(const Hinge<Spatial, T> &h, X *x) {
  for (const int k : {0, 3}) {
    const X u = h.cross_cosine * x[k] + h.cross_sine * x[k + 2], v = h.cross_cosine * x[k + 2] - h.cross_sine * x[k];
    x[k] = u, x[k + 2] = v;
  }
}
template <class T, class X> FFROBOT_INLINE void from_cross(const Hinge<Spatial, T> &h, X *x) {
  for (const int k : {0, 3}) {
    const X u = h.cross_cosine * x[k] - h.cross_sine * x[k + 2], v = h.cross_cosine * x[k + 2] + h.cross_sine * x[k];
    x[k] = u, x[k + 2] = v;
  }
}

// Symmetric matrix of rows, from both sides
template <class F, int d, class T> FFROBOT_INLINE void both_sides(const F &change, Pack<T, d> *M) {
  change(M);
  for (int i = 0; i < d; ++i) {
    T x[d];
    for (int j = 0; j < d; ++j)
      x[j] = M[i][j];
    change(x);
    for (int j = 0; j < d; ++j)
      M[i].set(j, x[j]);
  }
}

// One freedom along component f: row and column of M leave, with what the rotor on the inner section adds.
template <class Space, class T, int W>
FFROBOT_INLINE void eliminate_freedom(const Node<Space> &node, int freedom, const T *force, Hinge<Space, T> &hinge,
                                      const Mechanism<Space> &m, Workspace<Space, T> &w, Pack<T, Space::dim> *M,
                                      Pack<T, W> *H, Pack<T, W> (&S)[W]) {
  constexpr int d = Space::dim, stride = stride_of(W);
  using Cols = Pack<T, W>;
  const int f = node.shape.freedoms.component[freedom];
  Cols applied = Cols::zero(); // force along the freedom
  if (force)
    applied.set(0, force[freedom]);
  if (node.has_rows)
    for (std::size_t r = 0; r < w.active.size(); ++r) {
      const Row &row = m.rows[w.active[r]];
      if (row.node >= 0 && &m.nodes[row.node] == &node && row.freedom == freedom)
        applied.set(static_cast<int>(r) + 1, T(-1.));
    }
  const Cols su = H[f] - applied;
  Pack<T, d> &U = hinge.U[freedom];
  U = M[f];
  const double J = node.rotor_inertia, N = node.gear_ratio;
  const T M_ff = M[f][f], D = J > 0 ? M_ff + N * N * J : M_ff;
  hinge.D_inverse[freedom] = T(1.) / D;
  const Cols sd = hinge.D_inverse[freedom] * su;
  sd.write(w.answer.data() + node.joint_slot(freedom) * stride);
  if (W > 1)
    gain(S, sd, su);
  for (int j = 0; j < d; ++j) {
    const T U_j = U[j];
    if (j != f) {
      M[j] -= (U_j * hinge.D_inverse[freedom]) * U;
      M[j].set(f, J > 0 ? T(U_j * (N * (N - 1) * J) * hinge.D_inverse[freedom]) : T(0.));
      H[j] -= U_j * sd;
    }
  }
  if (J > 0) {
    M[f] = (N * (N - 1) * J * hinge.D_inverse[freedom]) * U;
    M[f].set(f, M_ff * ((N - 1) * (N - 1) * J) * hinge.D_inverse[freedom]);
    U.set(f, M_ff + N * J);
    H[f] -= U[f] * sd;
  } else {
    M[f] = Pack<T, d>::zero();
    H[f] = applied;
  }
}

template <class Space, class T, int W>
inline void eliminate_joint(const Mechanism<Space> &m, const Node<Space> &node, const T *q, const T *force,
                            Workspace<Space, T> &w, Pack<T, Space::dim> *M, Pack<T, W> *H, Pack<T, W> (&S)[W]) {
  constexpr int d = Space::dim;
  Hinge<Space, T> &hinge = w.hinges[&node - m.nodes.data()];
  T applied[6], outer[6];
  if (force) {
    for (int i = 0; i < 6; ++i)
      applied[i] = T(0.);
    for (int k = 0; k < node.shape.freedoms.count; ++k)
      applied[k] = force[k];
    if (node.shape.in_inner_axes) { // freedoms ascending: translations first
      T x[6] = {applied[0], applied[1], T(0.), T(0.), T(0.), T(0.)};
      if (Space::dim == 6 && node.joint == JointKind::free)
        x[2] = applied[2];
      to_outer_axes(node, q, x, outer);
      for (int k = 0; k < (node.joint == JointKind::free ? Space::linear : 2); ++k)
        applied[k] = outer[k];
    }
  }
  const bool universal = d == 6 && node.joint == JointKind::universal, screw = d == 6 && node.joint == JointKind::screw;
  if constexpr (d == 6) {
    if (universal) {
      const auto change = [&](auto *x) { to_cross(hinge, x); };
      both_sides<decltype(change), d, T>(change, M);
      change(H);
    } else if (screw) { // a_z = a_z' + lead alpha_z: the free direction is the last axis
      const auto change = [&](auto *x) { x[5] += node.lead * x[2]; };
      both_sides<decltype(change), d, T>(change, M);
      change(H);
    }
  }
  for (int k = node.shape.freedoms.count - 1; k >= 0; --k)
    eliminate_freedom<Space, T, W>(node, k, force ? applied : nullptr, hinge, m, w, M, H, S);
  for (int i = 0; i < d; ++i)
    hinge.Lambda[i] = M[i]; // in axes of the cross, or without the last row: `factors` knows
  if constexpr (d == 6) {
    if (universal) {
      const auto change = [&](auto *x) { from_cross(hinge, x); };
      both_sides<decltype(change), d, T>(change, M);
      change(H);
    } else if (screw) {
      const auto change = [&](auto *x) { x[5] -= node.lead * x[2]; };
      both_sides<decltype(change), d, T>(change, M);
      change(H);
    }
  }
}

// Hands H over to the port, with what velocities do at the joint.
template <class Space, class T, int W>
inline void hand_over(const Mechanism<Space> &m, const Node<Space> &node, Workspace<Space, T> &w,
                      const Pack<T, Space::dim> *M, Pack<T, W> *H, Pack<T, W> (&S)[W]) {
  constexpr int d = Space::dim, stride = stride_of(W);
  using Cols = Pack<T, W>;
  const Hinge<Space, T> &hinge = w.hinges[&node - m.nodes.data()];
  if (W > 1)
    for (int i = 0; i < d; ++i)
      for (int r = 1; r < W; ++r)
        S[r].add(0, -(hinge.c[i] * H[i][r]));
  T by_velocity[d];
  multiply<d, T>(M, hinge.c, by_velocity);
  for (int i = 0; i < d; ++i)
    H[i].add(0, by_velocity[i]);
  if constexpr (d == 6)
    if (node.rotor_inertia > 0)
      H[3].add(0, hinge.gyro[0]), H[4].add(0, hinge.gyro[1]);
  Cols P[d];
  Space::template Turn<T>::add_moment(hinge.r, H);
  hinge.turn.apply(H, P);
  if (node.parent < 0) {
    T A[d];
    ground_acceleration(m, node.parent_port, A);
    for (int i = 0; i < d; ++i)
      for (int r = 1; r < W; ++r)
        S[r].add(0, -(A[i] * P[i][r]));
    return;
  }
  T *to = w.force.data() + node.parent_port * d * stride;
  if (m.cleared[node.parent_port])
    for (int i = 0; i < d; ++i)
      P[i] += Cols::read(to + i * stride);
  for (int i = 0; i < d; ++i)
    P[i].write(to + i * stride);
}

template <class Space, class T, int W>
inline void inward(const Mechanism<Space> &m, const Node<Space> &node, const T *q, const T *v, const Forces<T> &forces,
                   Workspace<Space, T> &w, Pack<T, W> (&S)[W]) {
  constexpr int d = Space::dim;
  using Cols = Pack<T, W>;
  Pack<T, d> M[d];
  T b[d];
  auto &state = w.bodies[&node - m.nodes.data()];
  evaluate_inertia(node, q + node.p_q(), v + node.p_v(), state, M, b);
  Cols H[d];
  for (int i = 0; i < d; ++i)
    H[i] = Cols::zero(), H[i].set(0, b[i]);
  if (node.ports())
    eliminate_ports<Space, T, W>(m, node, w, M, H, S);
  if (node.inboard >= 0)
    move_to_section<Space, T, W>(m, node, w, M, H, S);
  eliminate_joint<Space, T, W>(m, node, q + node.q, forces.generalized ? forces.generalized + node.v : nullptr, w, M, H,
                               S);
  hand_over<Space, T, W>(m, node, w, M, H, S);
}

} // namespace ffrobot::recursion
