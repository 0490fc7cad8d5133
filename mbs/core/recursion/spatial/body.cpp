#include "core/recursion/spatial/body.h"

namespace ffrobot::recursion::spatial {

using ExtendedMatrix = Matrix<long double, Dynamic, Dynamic>;

namespace {

constexpr int before[3] = {5, 6, 1}, after[3] = {7, 2, 3}; // m_thetaf_x = integral of u_y S_z - u_z S_y, and so on

MatrixXd I_bar_of(const SpatialData &data) { return data.I_bar.size() ? data.I_bar : MatrixXd::Zero(9, data.modes()); }

// With that of spin: h_s along the axis is half of it on either side of the diagonal, h_a = eps_abc I_bar_bc. What is
// symmetric stays, so that all that is made of I_bar, gyroscopic moments included, has h_s as it has the rest of h.
MatrixXd complete_I_bar(const SpatialData &data) {
  MatrixXd I_bar = I_bar_of(data);
  if (data.h_spin.size() > 0)
    for (int c = 0; c < 3; ++c) {
      const int a = (c + 1) % 3, b = (c + 2) % 3;
      I_bar.row(3 * a + b) += 0.5 * data.spin_axis[c] * data.h_spin.transpose();
      I_bar.row(3 * b + a) -= 0.5 * data.spin_axis[c] * data.h_spin.transpose();
    }
  return I_bar;
}

// g_ab, a <= b, of data along the axes of T_s; zero where it is nothing but rounding
MatrixXd symmetric_I_bar(const SpatialData &data) {
  const double size = std::sqrt(data.J2.trace()); // of the integral over rho x Phi, where that of rho Phi Phi is 1
  const MatrixXd I = complete_I_bar(data);
  MatrixXd g = MatrixXd::Zero(6, data.modes());
  Index s = 0;
  for (int a = 0; a < 3; ++a)
    for (int b = a; b < 3; ++b, ++s) {
      const RowVectorXd row = 0.5 * (I.row(3 * a + b) + I.row(3 * b + a));
      if (row.cwiseAbs().maxCoeff() > negligible * size)
        g.row(s) = row;
    }
  return g;
}

// f with A = diag(f) G, f 2 or -2 or, where both are zero, 0; padded, empty where there is none
Aligned<double> row_factors(const MatrixXd &A, const MatrixXd &G) {
  Aligned<double> f(padded(static_cast<int>(A.rows())), 0.0);
  for (Index i = 0; i < A.rows(); ++i) {
    if (A.row(i).isZero(0) && G.row(i).isZero(0))
      continue;
    const double factor = A.row(i).dot(G.row(i)) > 0 ? 2 : -2;
    if ((A.row(i) - factor * G.row(i)).cwiseAbs().maxCoeff() > negligible)
      return {};
    f[i] = factor;
  }
  return f;
}

int rows_that_are_not_zero(const MatrixXd &M) {
  int count = 0;
  for (Index r = 0; r < M.rows(); ++r)
    count += (M.row(r).array() != 0).any();
  return count;
}

// x_k = R_kl y_l of matrices
std::vector<MatrixXd> turned(const Matrix3d &R, const MatrixXd *y) {
  std::vector<MatrixXd> x;
  for (int k = 0; k < 3; ++k)
    x.push_back(R(k, 0) * y[0] + R(k, 1) * y[1] + R(k, 2) * y[2]);
  return x;
}

std::vector<MatrixXd> turned_K(const Matrix3d &R, const SpatialMarker &marker) {
  if (marker.K.empty())
    return {};
  std::vector<MatrixXd> K = turned(R, marker.K.data()), moments = turned(R, marker.K.data() + 3);
  K.insert(K.end(), moments.begin(), moments.end());
  return K;
}

// Integrals with G about another point, along other axes
void move_stiffening(const SpatialData &data, const Vector3d &position, const Matrix3d &R, SpatialData &to) {
  to.K_s = turned(R, data.K_s.data());
  std::vector<MatrixXd> about_axes; // x_k along R, G along the old axes
  for (int k = 0; k < 3; ++k)
    for (std::size_t l = 0; l < 3; ++l) {
      MatrixXd sum = MatrixXd::Zero(data.modes(), data.modes());
      for (std::size_t i = 0; i < 3; ++i)
        sum += R(k, i) * (data.K_x[3 * i + l] - position[i] * data.K_s[l]);
      about_axes.push_back(sum);
    }
  to.K_x.clear();
  for (std::size_t k = 0; k < 3; ++k)
    for (MatrixXd &K : turned(R, about_axes.data() + 3 * k))
      to.K_x.push_back(std::move(K));
}

} // namespace

std::vector<MatrixXd> section_K(const SpatialMarker &marker) { return turned_K(marker.triad.transpose(), marker); }

SpatialData moved(const SpatialData &data, const Vector3d &position, const Matrix3d &triad) {
  SpatialData to = data;
  const Matrix3d R = triad.transpose();
  const Index n = data.modes();
  to.first_moment = R * (data.first_moment - data.mass * position);
  to.J2 = R *
          (data.J2 - position * data.first_moment.transpose() - data.first_moment * position.transpose() +
           data.mass * position * position.transpose()) *
          triad;
  to.spin_axis = R * data.spin_axis, to.spin_booked = R * data.spin_booked, to.axes = R * data.axes;
  if (n) {
    to.S_bar = R * data.S_bar;
    MatrixXd I_bar = I_bar_of(data);
    for (int k = 0; k < 3; ++k)
      I_bar.middleRows<3>(3 * k) -= position[k] * data.S_bar;
    to.I_bar.setZero(9, n);
    for (int k = 0; k < 3; ++k)
      for (int l = 0; l < 3; ++l)
        to.I_bar.middleRows<3>(3 * k) += R(k, l) * R * I_bar.middleRows<3>(3 * l);
    for (int kl = 0; kl < 9; ++kl) {
      to.S_bar_kl[kl].setZero(n, n);
      for (int ij = 0; ij < 9; ++ij)
        if (data.S_bar_kl[ij].size())
          to.S_bar_kl[kl] += R(kl / 3, ij / 3) * R(kl % 3, ij % 3) * data.S_bar_kl[ij];
    }
  }
  if (data.is_stiffened())
    move_stiffening(data, position, R, to);
  for (SpatialMarker &marker : to.markers) {
    marker.K = turned_K(R, marker);
    marker.position = R * (marker.position - position);
    marker.triad = R * marker.triad;
    if (n) {
      marker.Phi.topRows<3>() = (R * marker.Phi.topRows<3>()).eval();
      marker.Phi.bottomRows<3>() = (R * marker.Phi.bottomRows<3>()).eval();
    }
  }
  return to;
}

Body::Body(const SpatialData &data, const std::vector<int> &used) : n(static_cast<int>(data.modes())) {
  mass = data.mass;
  for (int i = 0; i < 3; ++i)
    s0[i] = data.first_moment[i];
  const SpatialData along_axes = moved(data, Vector3d::Zero(), data.axes);
  const MatrixXd g = n ? symmetric_I_bar(along_axes) : MatrixXd();
  width = lanes * std::max(1 + static_cast<int>(used.size()), (rows_that_are_not_zero(g) + 1) / 2);
  if (n && data.is_stiffened())
    stiffening = std::make_shared<const Stiffening>(data, used);
  fill_rows(data, used, complete_I_bar(data));
  fill_residuals(data, used);
  take_damping(data, *this);
  if (n)
    fill_tensors(along_axes, data.axes, g);
}

// Whether rows from this one on, of a port, have terms of second order
bool Body::is_curved(int row) const {
  for (int r = row; stiffening && r < row + 6; ++r)
    if (stiffening->at_ports[r - lanes].kind != ModeMatrix::Kind::zero)
      return true;
  return false;
}

// Rows of W, and ports
void Body::fill_rows(const SpatialData &data, const std::vector<int> &used, const MatrixXd &I) {
  MatrixXd all = MatrixXd::Zero(width, n);
  if (n) {
    all.topRows<3>() = data.S_bar;
    for (int c = 0; c < 3; ++c)
      all.row(h + c) = I.row(before[c]) - I.row(after[c]);
  }
  for (const int marker_index : used) {
    const SpatialMarker &marker = data.markers[marker_index];
    Port port;
    port.row = lanes * (1 + static_cast<int>(ports.size()));
    for (int k = 0; k < 3; ++k) {
      port.r[k] = marker.position[k];
      for (int l = 0; l < 3; ++l)
        port.R[k][l] = port.turning[l][3 + k] = marker.triad(k, l);
    }
    if (n) {
      all.middleRows<3>(port.row) = marker.triad.transpose() * marker.Phi.topRows<3>();
      all.middleRows<3>(port.row + 3) = marker.triad.transpose() * marker.Phi.bottomRows<3>();
      port.is_flexible = marker.Phi.cwiseAbs().maxCoeff() > negligible / std::sqrt(mass) || is_curved(port.row);
    }
    ports.push_back(port);
  }
  W.assign(even(n) * width, 0.0);
  rows.assign(width * padded(n), 0.0);
  for (int r = 0; r < width; ++r)
    for (int k = 0; k < n; ++k)
      W[k * width + r] = rows[r * padded(n) + k] = all(r, k);
}

// What elimination leaves, differences taken in extended precision
void Body::fill_residuals(const SpatialData &data, const std::vector<int> &used) {
  ExtendedMatrix extended(width, n);
  for (int r = 0; r < width; ++r)
    for (int k = 0; k < n; ++k)
      extended(r, k) = W[k * width + r];
  const ExtendedMatrix gram_ =
      n ? ExtendedMatrix(extended.lazyProduct(extended.transpose())) : ExtendedMatrix::Zero(width, width);
  G.resize(width * width);
  for (int r = 0; r < width; ++r)
    for (int c = 0; c < width; ++c)
      G[r * width + c] = static_cast<double>(gram_(r, c));
  const auto tilde = [](const Vector3d &x) {
    return (Matrix3d() << 0, -x[2], x[1], x[2], 0, -x[0], -x[1], x[0], 0).finished();
  };
  const Matrix3d inertia =
      data.J2.trace() * Matrix3d::Identity() - data.J2 + data.J_spin * data.spin_axis * data.spin_axis.transpose();
  Matrix<double, 6, 6> M;
  M << mass * Matrix3d::Identity(), -tilde(data.first_moment), tilde(data.first_moment), inertia;
  for (int r = 0; r < 6; ++r)
    for (int c = 0; c < 6; ++c)
      residual[r][c] = static_cast<double>(M(r, c) - gram_(r, c));
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j <= i; ++j)
      J0[symmetric_index(i, j)] = inertia(i, j);
  for (std::size_t i = 0; i < ports.size(); ++i) {
    const SpatialMarker &marker = data.markers[used[i]];
    const Matrix3d R = marker.triad.transpose();
    Matrix<double, 6, 6> X;
    X << R, -R * tilde(marker.position), Matrix3d::Zero(), R;
    for (int r = 0; r < 6; ++r)
      for (int c = 0; c < 6; ++c)
        ports[i].T[r][c] = stiffening ? X(r, c) : static_cast<double>(X(r, c) - gram_(ports[i].row + r, c));
  }
}

// The row of W that is g from now on
int Body::add_to_W(const VectorXd &g) {
  const auto count = std::count_if(stretches.begin(), stretches.end(), [](const Stretch &s) { return s.g_row >= 0; });
  const int row = lanes * static_cast<int>(count / 2) + 6 + static_cast<int>(count % 2);
  for (int k = 0; k < n; ++k)
    W[k * width + row] = g[k];
  return row;
}

// T_s, g_s and G_s; returned is s, -1 where these modes do not stretch
int Body::add_stretch(const Matrix3d &T, const MatrixXd &G, const VectorXd &g) {
  Stretch of;
  const bool has_g = !g.isZero(0);
  of.G = ModeMatrix(G);
  if (!has_g && of.G.kind == ModeMatrix::Kind::zero)
    return -1;
  of.g.assign(padded(n), 0.0);
  if (has_g) {
    of.g_row = add_to_W(g);
    std::copy_n(g.data(), n, of.g.data());
  }
  const Matrix3d J = T.trace() * Matrix3d::Identity() - T;
  const auto s = stretches.size();
  for (int i = 0; i < 3; ++i) {
    tension[i][s] = J(i, i), tension[3 + i][s] = 2 * J(i, (i + 1) % 3);
    for (int j = 0; j <= i; ++j)
      of.inertia[symmetric_index(i, j)] = J(i, j);
  }
  stretches.push_back(std::move(of));
  return static_cast<int>(s);
}

// All T_s, g_s, G_s and z_c, A_c, from data along the axes z, which are the columns of `axes`
void Body::fill_tensors(const SpatialData &data, const Matrix3d &axes, const MatrixXd &g) {
  const auto without_spin = [&](int slot) { // transposed: column i multiplies p_i
    const auto &given = data.S_bar_kl[slot];
    MatrixXd block = given.size() ? MatrixXd(given.transpose()) : MatrixXd::Zero(n, n);
    if (data.S_spin.size())
      block -= data.spin_booked[slot / 3] * data.spin_booked[slot % 3] * data.S_spin;
    return block;
  };
  const auto cleaned = [](const MatrixXd &M) { return MatrixXd((M.array().abs() > negligible).select(M, 0.0)); };
  MatrixXd G[3][3];
  int stretch_of[3][3] = {{-1, -1, -1}, {-1, -1, -1}, {-1, -1, -1}};
  Index ab = 0;
  for (int a = 0; a < 3; ++a)
    for (int b = a; b < 3; ++b, ++ab) {
      G[a][b] = cleaned(0.5 * (without_spin(3 * a + b) + without_spin(3 * b + a)));
      Matrix3d T = axes.col(a) * axes.col(b).transpose();
      if (a != b)
        T += T.transpose().eval();
      stretch_of[a][b] = add_stretch(T, G[a][b], g.row(ab));
    }
  for (int c = 0; c < 3; ++c) {
    Twist of;
    const MatrixXd A = cleaned(without_spin(before[c]) - without_spin(after[c]));
    of.A = ModeMatrix(A);
    if (of.A.kind == ModeMatrix::Kind::zero)
      continue;
    const int a = std::min((c + 1) % 3, (c + 2) % 3), b = std::max((c + 1) % 3, (c + 2) % 3), like = stretch_of[a][b];
    if (like >= 0 && of.A.kind == ModeMatrix::Kind::full)
      if (of.by_stretch = row_factors(A, G[a][b]); !of.by_stretch.empty())
        stretches[like].twist = static_cast<int>(twists.size());
    for (int i = 0; i < 3; ++i)
      of.axis[3 + i] = axes(i, c);
    twists.push_back(std::move(of));
  }
}

} // namespace ffrobot::recursion::spatial
