#include "core/body/packed_rows.h"

#include "core/body/planar_body.h"

#include <Eigen/LU>

namespace ffrobot {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

constexpr Index empty_row = 3;

// At most eight rows of U.
using LowRank = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 8, 8>;
using LowRankVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 8, 1>;

bool moves(const PlanarBody &body, Index row) {
  for (const auto &second : body.second_order)
    if (second.row == row)
      return true;
  return (row == 2 && body.S_tilde.size() > 0) || (row < 3 && body.affine);
}

bool carries_anything(const PlanarBody &body, Index row) { return moves(body, row) || !body.W.row(row).isZero(0); }

// A row count known to the compiler keeps the sums in registers.
template <int Count> void project_rows(const double *p, const double *p_dot, Index first, PackedRows &s) {
  constexpr int groups = Count / lane_count;
  Lanes Wp[groups] = {}, Wp_dot[groups] = {}, Wk[groups] = {};
  const Index n = s.W.cols(), stride = s.rows();
  const double *column = s.W.data() + first, *k = s.elastic_force.data();
  for (Index i = 0; i < n; ++i, column += stride)
    for (int group = 0; group < groups; ++group) {
      const Lanes w = load(column + group * lane_count);
      Wp[group] += w * p[i];
      Wp_dot[group] += w * p_dot[i];
      Wk[group] += w * k[i];
    }
  for (int group = 0; group < groups; ++group) {
    const Index i = first + group * lane_count;
    store(s.Wp.data() + i, Wp[group]);
    store(s.Wp_dot.data() + i, Wp_dot[group]);
    store(s.Wk.data() + i, Wk[group]);
  }
}

// Rows of W W^T, in the columns of rows that move
template <int Count> void multiply_rows(Index first, PackedRows &s) {
  constexpr int groups = Count / lane_count;
  const Index n = s.W.cols(), stride = s.rows();
  for (const Index j : s.moving) {
    Lanes sum[groups] = {};
    const double *W = s.W.data();
    for (Index i = 0; i < n; ++i, W += stride)
      for (int group = 0; group < groups; ++group)
        sum[group] += load(W + first + group * lane_count) * W[j];
    for (int group = 0; group < groups; ++group)
      store(s.gram.data() + j * stride + first + group * lane_count, sum[group]);
  }
}

template <int Count> void combine_rows(const double *z, Index first, PackedRows &s) {
  const Index n = s.W_transposed.rows();
  const double *W_transposed = s.W_transposed.data() + first * n;
  Lanes factor[Count];
  for (int row = 0; row < Count; ++row)
    factor[row] = Lanes{} + z[first + row];
  for (Index i = 0; i < n; i += lane_count) {
    double *out = s.W_transposed_z.data() + i;
    Lanes sum[lane_count] = {first == 0 ? Lanes{} : load(out)}; // several: products need not wait for each other
    for (int row = 0; row < Count; ++row)
      sum[row % lane_count] += factor[row] * load(W_transposed + row * n + i);
    store(out, (sum[0] + sum[1]) + (sum[2] + sum[3]));
  }
}

// Calls f.operator()<count>(first) on pieces of 16, 12, 8 and 4 rows.
template <class Function> void in_pieces(Index rows, const Function &f) {
  Index first = 0;
  for (; rows - first > 16; first += 16)
    f.template operator()<16>(first);
  switch (rows - first) {
  case 4:
    return f.template operator()<4>(first);
  case 8:
    return f.template operator()<8>(first);
  case 12:
    return f.template operator()<12>(first);
  case 16:
    return f.template operator()<16>(first);
  }
}

} // namespace

PackedRows::PackedRows(const PlanarBody &body) : place(static_cast<std::size_t>(body.W.rows()), empty_row) {
  const Index markers = body.markers(), n = body.modes();
  const auto at = [&](Index row) -> Index & { return place[static_cast<std::size_t>(row)]; };
  const auto used = [&](Index k) { return body.marker_rows[static_cast<std::size_t>(k)]; };
  at(0) = 0, at(1) = 1, at(2) = 2;
  Index next = first_port;
  const auto put_translation = [&](Index k) {
    at(3 + 3 * k) = next++;
    at(4 + 3 * k) = next++;
  };
  for (Index k = 0; k < markers; ++k)
    if (used(k) > 0)
      put_translation(k);
  const Index first_rotation = next;
  for (Index k = 0; k < markers; ++k)
    if (used(k) == 3)
      at(5 + 3 * k) = next++;
  const Index last_rotation = next;
  next = padded(next);
  ports = next - first_port;
  for (Index k = 0; k < markers; ++k)
    if (used(k) == 0 && (carries_anything(body, 3 + 3 * k) || carries_anything(body, 4 + 3 * k)))
      put_translation(k);
  for (Index k = 0; k < markers; ++k)
    if (used(k) < 3 && carries_anything(body, 5 + 3 * k))
      at(5 + 3 * k) = next++;

  affine = next;
  for (Index row = body.affine_row(); row < body.W.rows(); ++row)
    at(row) = next++;

  const Index rows = padded(next);
  W = Eigen::MatrixXd::Zero(rows, n);
  for (Index row = 0; row < body.W.rows(); ++row)
    if (at(row) != empty_row)
      W.row(at(row)) = body.W.row(row);
  W_transposed = Eigen::MatrixXd::Zero(padded(n), rows);
  W_transposed.topRows(n) = W.transpose();
  G = W * W.transpose();
  if (body.affine) {
    for (Index row = 0; row < body.affine_row() + body.affine.moving; ++row)
      if (moves(body, row) || row >= body.affine_row())
        moving.push_back(at(row));
    gram = G;
    with_U = reaction = Eigen::MatrixXd::Zero(rows, body.affine.rank());
  }
  elastic_force = VectorXd::Zero(n);
  W_transposed_z = VectorXd::Zero(padded(n));
  Wp = Wp_dot = Wk = VectorXd::Zero(rows);
  along_x = along_y = is_translation = is_rotation = turn = position = VectorXd::Zero(ports);
  for (Index k = 0; k < markers; ++k)
    if (used(k) > 0) {
      const Index i = port(3 + 3 * k);
      along_x[i] = along_y[i + 1] = is_translation[i] = is_translation[i + 1] = turn[i + 1] = 1;
      turn[i] = -1;
      position.segment<2>(i) = body.marker_positions[static_cast<std::size_t>(k)];
    }
  is_rotation.segment(first_rotation - first_port, last_rotation - first_rotation).setOnes();
}

void PackedRows::replace(Index row, const Eigen::Ref<const Eigen::RowVectorXd> &values) {
  const Index i = place[static_cast<std::size_t>(row)];
  W.row(i) = values;
  W_transposed.col(i).head(W.cols()) = values.transpose();
  if (gram.size())
    return; // all of G is made anew
  G.row(i).noalias() = W.row(i) * W_transposed.topRows(W.cols());
  G.col(i) = G.row(i).transpose();
}

void PackedRows::reduce(const Eigen::MatrixXd &C_inverse) {
  const Index rank = C_inverse.rows();
  in_pieces(rows(), [&]<int Count>(Index first) { multiply_rows<Count>(first, *this); });
  for (const Index j : moving)
    gram.row(j) = gram.col(j).transpose();
  with_U = gram.middleCols(affine, rank);
  const LowRank S = C_inverse + with_U.middleRows(affine, rank);
  const LowRank S_inverse = S.partialPivLu().inverse();
  reaction.noalias() = with_U.lazyProduct(S_inverse);
  G.noalias() = gram - reaction.lazyProduct(with_U.transpose());
}

void PackedRows::apply_inertia(const Eigen::MatrixXd &C, VectorXd &z) const {
  const Index rank = C.rows();
  const LowRankVector y = G.middleCols(affine, rank).transpose().lazyProduct(z);
  z.segment(affine, rank) -= C.lazyProduct(y);
}

void PackedRows::project(const PlanarBody &body, const double *p, const double *p_dot) {
  const bool damped = body.damping.cols() == 1;
  const double *k = body.stiffness.data(), *d = body.damping.data();
  double *__restrict force = elastic_force.data();
  double square = 0, product = 0;
  for (Index i = 0; i < W.cols(); ++i) {
    force[i] = k[i] * p[i] + (damped ? d[i] * p_dot[i] : 0.0);
    square += p[i] * p[i];
    product += p[i] * p_dot[i];
  }
  p_p = square;
  p_p_dot = product;
  in_pieces(rows(), [&]<int Count>(Index first) { project_rows<Count>(p, p_dot, first, *this); });
}

void PackedRows::combine(const VectorXd &z) {
  in_pieces(rows(), [&]<int Count>(Index first) { combine_rows<Count>(z.data(), first, *this); });
}

} // namespace ffrobot
