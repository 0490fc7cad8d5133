#include "core/recursion/planar/stiffening.h"

#include <Eigen/Geometry>

namespace ffrobot::recursion::planar {

namespace {

double negligible_K(const PlanarData &data) { return negligible_of(data, {data.K[0], data.K[1]}); }

// Products with x, y, x x + y y and x y - y x of what is given about `center` instead of the origin
template <class X> void move(const Vector2d &center, std::array<X, fields> &products) {
  products[2] -= center.x() * products[0] + center.y() * products[1];
  products[3] -= center.x() * products[1] - center.y() * products[0];
}

} // namespace

std::vector<MatrixXd> turned(const Matrix2d &R, const std::vector<MatrixXd> &y) {
  std::vector<MatrixXd> x = y;
  for (std::size_t k = 0; k < 2 && !y.empty(); ++k)
    x[k] = R(k, 0) * y[0] + R(k, 1) * y[1];
  return x;
}

bool is_curved(const PlanarData &data, const PlanarMarker &marker, int component) {
  const Matrix2d R = Eigen::Rotation2D<double>(-marker.angle).toRotationMatrix();
  const std::vector<MatrixXd> K = turned(R, marker.K);
  return !K.empty() && K[component].cwiseAbs().maxCoeff() > negligible_K(data);
}

std::vector<MatrixXd> moved_K(const PlanarData &data, const Vector2d &position, const Matrix2d &R) {
  if (!data.is_stiffened())
    return {};
  std::array<MatrixXd, fields> K;
  std::copy_n(data.K.begin(), fields, K.begin());
  move(position, K);
  return turned(R, {K.begin(), K.end()});
}

Stiffening::Stiffening(const PlanarData &data, const std::vector<int> &used, const std::vector<int> &first_rows) {
  const Index n = data.modes();
  const Vector2d center = data.first_moment / data.mass;
  const double J = data.inertia - data.mass * center.squaredNorm();
  const double root_J = J > negligible * data.inertia ? std::sqrt(J) : 0; // 0: all mass in a point
  root_mass = std::sqrt(data.mass);
  const double by_J = root_J > 0 ? 1 / root_J : 0, factor[fields] = {1 / root_mass, 1 / root_mass, by_J, by_J};
  const Vector2d g_0 = root_mass * center;
  g[0] = g_0.x(), g[1] = g_0.y(), g[2] = root_J;

  const RowVectorXd none = RowVectorXd::Zero(n);
  const auto or_none = [&](const VectorXd &x) { return x.size() ? RowVectorXd(x.transpose()) : none; };
  std::array<RowVectorXd, fields> with_modes{data.S_bar.row(0), data.S_bar.row(1), or_none(data.j), or_none(data.h)};
  std::array<MatrixXd, fields> with_G;
  std::copy_n(data.K.begin(), fields, with_G.begin());
  move(center, with_modes), move(center, with_G);
  MatrixXd F_all(fields, n);
  for (std::size_t f = 0; f < fields; ++f) {
    F_all.row(f) = factor[f] * with_modes[f];
    with_G[f] *= factor[f];
  }
  const double limit = negligible * largest_of({with_G.begin(), with_G.end()});
  for (std::size_t f = 0; f < fields; ++f)
    K[f] = ModeMatrix(with_G[f], limit);
  F.assign(F_all.data(), F_all.data() + F_all.size());
  const MatrixXd rest = MatrixXd::Identity(n, n) - F_all.transpose() * F_all;
  m_ff_rest.assign(rest.data(), rest.data() + rest.size());

  for (std::size_t k = 0; k < used.size(); ++k) {
    const PlanarMarker &marker = data.markers[used[k]];
    for (std::size_t c = 0; c < marker.K.size(); ++c)
      if (ModeMatrix K_row(marker.K[c], negligible_K(data)); K_row.kind != ModeMatrix::Kind::zero)
        at_ports.push_back({first_rows[k] + static_cast<int>(c), std::move(K_row)});
  }
}

} // namespace ffrobot::recursion::planar
