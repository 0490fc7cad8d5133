#include "core/recursion/planar/body.h"

#include <Eigen/Geometry>

namespace ffrobot::recursion::planar {

PlanarData moved(const PlanarData &data, const Vector2d &position, double angle) {
  PlanarData to = data;
  const Matrix2d R = Eigen::Rotation2D<double>(-angle).toRotationMatrix();
  const double x = position.x(), y = position.y();
  to.first_moment = R * (data.first_moment - data.mass * position);
  to.inertia = data.inertia - 2 * position.dot(data.first_moment) + data.mass * position.squaredNorm();
  const Index n = data.modes();
  if (n) {
    to.S_bar = R * data.S_bar;
    to.h = (data.h.size() ? data.h : VectorXd::Zero(n)) - x * data.S_bar.row(1).transpose() +
           y * data.S_bar.row(0).transpose();
    to.j = (data.j.size() ? data.j : VectorXd::Zero(n)) - data.S_bar.transpose() * position;
  }
  to.K = moved_K(data, position, R);
  for (PlanarMarker &marker : to.markers) {
    marker.K = turned(R, marker.K);
    marker.position = R * (marker.position - position);
    marker.angle -= angle;
    if (n)
      marker.Phi.topRows<2>() = (R * marker.Phi.topRows<2>()).eval();
  }
  return to;
}

namespace {

// a - x . y, summed in extended precision: what is left after elimination is a small part of a
double less(double a, const RowVectorXd &x, const RowVectorXd &y) {
  long double sum = a;
  for (Index i = 0; i < x.size(); ++i)
    sum -= static_cast<long double>(x[i]) * y[i];
  return static_cast<double>(sum);
}

template <class M> bool vanishes(const M &matrix, double scale) {
  return matrix.size() == 0 || matrix.cwiseAbs().maxCoeff() <= 1e-12 * scale;
}

} // namespace

Body::Body(const PlanarData &data, const std::vector<int> &used, int tilted) : n(static_cast<int>(data.modes())) {
  mass = data.mass, J = data.inertia, sx = data.first_moment.x(), sy = data.first_moment.y();
  blocks = 1 + static_cast<int>(used.size()) / 2;
  padded = (n + 7) / 8 * 8;
  fill_rows(data, used, tilted);
  take_damping(data, *this);
  if (n && !vanishes(data.j, std::sqrt(J))) // a unit mode with all motion turning
    j = data.j;
  if (n && !vanishes(data.S_tilde, 1))
    S_tilde = data.S_tilde;
  if (n && data.m_xy.size() && !vanishes(data.m_xy - MatrixXd::Identity(n, n), 1))
    m_xy = data.m_xy;
  has_more = j.size() || S_tilde.size() || m_xy.size() || D_full.size() || stiffening;
}

void Body::fill_rows(const PlanarData &data, const std::vector<int> &used, int tilted) {
  MatrixXd W = MatrixXd::Zero(width(), n);
  if (n) {
    W.topRows<2>() = data.S_bar;
    if (data.h.size())
      W.row(H) = data.h.transpose();
  }
  std::vector<int> first_rows;
  for (std::size_t k = 0; k < used.size(); ++k) {
    const PlanarMarker &marker = data.markers[used[k]];
    Port port;
    port.x = marker.position.x(), port.y = marker.position.y(), port.angle = marker.angle;
    const int i = k;
    port.row = i == 0 ? 3 : 8 * ((i + 1) / 2) + 3 * ((i + 1) % 2);
    if (n) {
      W.middleRows<3>(port.row) = marker.Phi;
      port.is_flexible = !vanishes(marker.Phi, 1 / std::sqrt(mass));
      port.shifts = !vanishes(marker.Phi.topRows<2>(), 1 / std::sqrt(mass));
      port.turns = !vanishes(marker.Phi.row(2), 1 / std::sqrt(mass));
    }
    ports.push_back(port), first_rows.push_back(port.row);
  }
  if (n && data.is_stiffened()) {
    stiffening = std::make_shared<const Stiffening>(data, used, first_rows);
    for (Port &port : ports)
      for (const Stiffening::Row &curved : stiffening->at_ports)
        if (const int component = curved.row - port.row; component >= 0 && component < 3)
          port.is_flexible = true, (component == 2 ? port.turns : port.shifts) = true;
  }
  is_tilted = n && tilted >= 0;
  if (is_tilted)
    W.row(TILT) = data.markers[tilted].Phi.row(2);
  fill_layouts(W);
  fill_products(W);
}

// W as passes read it: by modes, by rows, and by blocks of lanes
void Body::fill_layouts(const MatrixXd &W) {
  columns.assign(std::max(n, 1) * width(), 0.0);
  rows.assign(padded * width(), 0.0);
  for (int r = 0; r < width(); ++r)
    for (int i = 0; i < n; ++i)
      columns[i * width() + r] = rows[r * padded + i] = W(r, i);
  for (int i = 0; blocks == 1 && i < padded; i += native_lanes)
    for (int r = 0; r < width(); ++r)
      for (int k = i; k < i + native_lanes; ++k)
        tiles.push_back(rows[r * padded + k]);
}

void Body::fill_products(const MatrixXd &W) {
  for (int r = 0; r < width(); ++r)
    for (int c = 0; c < width(); ++c)
      products.push_back(-less(0, W.row(r), W.row(c)));
  for (const Port &port : ports) {
    const double X[3][3] = {{1, 0, -port.y}, {0, 1, port.x}, {0, 0, 1}};
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c)
        products.push_back(less(X[r][c], W.row(port.row + r), W.row(c)));
  }
  const double M[3][3] = {{mass, 0, -sy}, {0, mass, sx}, {-sy, sx, J}};
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c)
      residual[r][c] = less(M[r][c], W.row(r), W.row(c));
}

} // namespace ffrobot::recursion::planar
