#include "core/recursion/spatial/stiffening.h"

#include "core/recursion/spatial/body.h"

namespace ffrobot::recursion::spatial {

using Eigen::Matrix4d;

namespace {

// N = L L^T (4, rank), columns in the order 1, x, y, z, without those that depend on others before; and which ones
struct Orthonormal {
  Matrix4d L = Matrix4d::Zero();
  std::vector<int> pivot;
};

Orthonormal orthonormal(const SpatialData &data) {
  Matrix4d N;
  N << data.mass, data.first_moment.transpose(), data.first_moment, data.J2;
  Orthonormal found;
  const double longest = N.diagonal().tail<3>().maxCoeff();
  for (int k = 0; k < 4; ++k) {
    const int count = found.pivot.size();
    const Eigen::Vector4d left = N.col(k) - found.L.leftCols(count) * found.L.row(k).head(count).transpose();
    if (!(left[k] > (k == 0 ? 0 : negligible * longest)))
      continue;
    found.L.col(count) = left / std::sqrt(left[k]);
    found.pivot.push_back(k);
  }
  return found;
}

// Products with phi_f from those with 1, x, y, z: forward substitution
template <class X> std::vector<X> by_fields(const Orthonormal &fields, const std::array<X, 4> &products) {
  std::vector<X> found;
  for (std::size_t f = 0; f < fields.pivot.size(); ++f) {
    const int k = fields.pivot[f];
    X left = products[k];
    for (std::size_t e = 0; e < f; ++e)
      left -= fields.L(k, e) * found[e];
    found.push_back(left / fields.L(k, f));
  }
  return found;
}

} // namespace

double negligible_K(const SpatialData &data) { return negligible_of(data, data.K_s); }

Stiffening::Stiffening(const SpatialData &data, const std::vector<int> &used) {
  project(data);
  fill_ports(data, used);
}

void Stiffening::project(const SpatialData &data) {
  const auto n = data.modes();
  const int stride = padded(static_cast<int>(n));
  const Orthonormal orthonormal_fields = orthonormal(data);
  fields = static_cast<int>(orthonormal_fields.pivot.size());
  root_mass = std::sqrt(data.mass);
  std::vector<MatrixXd> all_K;
  F.assign(3 * fields * stride, 0.0);
  for (int c = 0; c < 3; ++c) {
    std::array<RowVectorXd, 4> with_modes;
    std::array<MatrixXd, 4> with_G;
    with_modes[0] = data.S_bar.row(c), with_G[0] = data.K_s[c];
    for (int k = 0; k < 3; ++k) {
      const int slot = 3 * k + c;
      with_modes[k + 1] = data.I_bar.size() ? RowVectorXd(data.I_bar.row(slot)) : RowVectorXd(RowVectorXd::Zero(n));
      with_G[k + 1] = data.K_x[slot];
    }
    const auto F_c = by_fields(orthonormal_fields, with_modes);
    const auto K_c = by_fields(orthonormal_fields, with_G);
    for (int f = 0; f < fields; ++f) {
      g[c][f] = orthonormal_fields.L(1 + c, f);
      std::copy_n(F_c[f].data(), n, F.begin() + (c * fields + f) * stride);
      all_K.push_back(K_c[f]);
    }
  }
  MatrixXd rest = MatrixXd::Identity(n, n);
  const double limit = negligible * largest_of(all_K);
  for (std::size_t i = 0; i < all_K.size(); ++i) {
    K.emplace_back(all_K[i], limit);
    const Map<const VectorXd> F_i(row(static_cast<int>(i), static_cast<int>(n)), n);
    if (K.back().kind != ModeMatrix::Kind::zero)
      rest -= F_i * F_i.transpose();
  }
  m_ff_rest.assign(n * stride, 0.0);
  Map<MatrixXd>(m_ff_rest.data(), stride, n).topRows(n) = rest; // symmetric
}

void Stiffening::fill_ports(const SpatialData &data, const std::vector<int> &used) {
  const auto n = data.modes();
  const double limit = negligible_K(data);
  for (const int index : used) {
    const std::vector<MatrixXd> K_section = section_K(data.markers[index]);
    for (std::size_t r = 0; r < lanes; ++r)
      at_ports.emplace_back(r < K_section.size() ? K_section[r] : MatrixXd::Zero(n, n).eval(), limit);
  }
}

} // namespace ffrobot::recursion::spatial
