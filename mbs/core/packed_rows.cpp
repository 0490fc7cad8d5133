#include "core/packed_rows.h"

#include "core/planar_body.h"

namespace ffrobot {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

constexpr Index empty_row = 3;

bool moves(const PlanarBody &body, Index row) {
  for (const auto &second : body.second_order)
    if (second.row == row)
      return true;
  return row == 2 && body.S_tilde.size() > 0;
}

bool carries_anything(const PlanarBody &body, Index row) { return moves(body, row) || !body.W.row(row).isZero(0); }

// A row count known to the compiler keeps the sums in registers.
template <int Count>
void project_rows(const PlanarBody &body, const double *p, const double *p_dot, Index first, PackedRows &s) {
  using Sum = Eigen::Array<double, Count, 1>;
  Sum Wp = Sum::Zero(), Wp_dot = Sum::Zero(), Wk = Sum::Zero();
  const Index n = body.modes(), stride = s.rows();
  const double *column = s.W.data() + first, *stiffness = body.stiffness.data();
  const double *damping = body.damping.cols() == 1 ? body.damping.data() : nullptr;
  for (Index i = 0; i < n; ++i, column += stride) {
    const auto w = Eigen::Map<const Sum>(column);
    double k = stiffness[i] * p[i];
    if (damping)
      k += damping[i] * p_dot[i];
    Wp += w * p[i];
    Wp_dot += w * p_dot[i];
    Wk += w * k;
  }
  Eigen::Map<Sum>(s.Wp.data() + first) = Wp;
  Eigen::Map<Sum>(s.Wp_dot.data() + first) = Wp_dot;
  Eigen::Map<Sum>(s.Wk.data() + first) = Wk;
}

template <int Count>
void accumulate_rows(const double *W_transposed, const double *z, Index n, double *__restrict out) {
  for (Index k = 0; k < n; ++k) {
    double sum = out[k];
    for (int row = 0; row < Count; ++row)
      sum += z[row] * W_transposed[row * n + k];
    out[k] = sum;
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

  const Index rows = padded(next);
  W = Eigen::MatrixXd::Zero(rows, n);
  for (Index row = 0; row < body.W.rows(); ++row)
    if (at(row) != empty_row)
      W.row(at(row)) = body.W.row(row);
  W_transposed = W.transpose();
  G = W * W_transposed;
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
  W_transposed.col(i) = values.transpose();
  G.row(i).noalias() = W.row(i) * W_transposed;
  G.col(i) = G.row(i).transpose();
}

void PackedRows::project(const PlanarBody &body, const double *p, const double *p_dot) {
  in_pieces(rows(), [&]<int Count>(Index first) { project_rows<Count>(body, p, p_dot, first, *this); });
}

void PackedRows::accumulate(const VectorXd &z, double *out) const {
  const Index n = W.cols();
  in_pieces(rows(), [&]<int Count>(Index first) {
    accumulate_rows<Count>(W_transposed.data() + first * n, z.data() + first, n, out);
  });
}

} // namespace ffrobot
