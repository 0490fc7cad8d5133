#include "core/recursion/spatial/body.h"

#include <algorithm>

namespace ffrobot::recursion::spatial {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using ExtendedMatrix = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;

namespace {

constexpr double negligible = 1e-12; // as in mbs/model/planar_body.py

// I_bar with that of spin: h gains h_s along the axis
MatrixXd complete_I_bar(const SpatialData &data) {
  const Index n = data.modes();
  return data.I_bar.size() ? data.I_bar : MatrixXd::Zero(9, n);
}

} // namespace

SpatialData moved(const SpatialData &data, const Vector3d &position, const Matrix3d &triad) {
  SpatialData to = data;
  const Matrix3d R = triad.transpose();
  const Index n = data.modes();
  to.first_moment = R * (data.first_moment - data.mass * position);
  to.J2 = R *
          (data.J2 - position * data.first_moment.transpose() - data.first_moment * position.transpose() +
           data.mass * position * position.transpose()) *
          triad;
  to.spin_axis = R * data.spin_axis, to.spin_booked = R * data.spin_booked;
  if (n) {
    to.S_bar = R * data.S_bar;
    MatrixXd I_bar = complete_I_bar(data);
    for (int k = 0; k < 3; ++k)
      I_bar.middleRows<3>(3 * k) -= position[k] * data.S_bar;
    to.I_bar.setZero(9, n);
    for (int k = 0; k < 3; ++k)
      for (int l = 0; l < 3; ++l)
        to.I_bar.middleRows<3>(3 * k) += R(k, l) * R * I_bar.middleRows<3>(3 * l);
    for (int k = 0; k < 3; ++k)
      for (int l = 0; l < 3; ++l) {
        MatrixXd sum = MatrixXd::Zero(n, n);
        for (int i = 0; i < 3; ++i)
          for (int j = 0; j < 3; ++j)
            if (data.S_bar_kl[static_cast<std::size_t>(3 * i + j)].size())
              sum += R(k, i) * R(l, j) * data.S_bar_kl[static_cast<std::size_t>(3 * i + j)];
        to.S_bar_kl[static_cast<std::size_t>(3 * k + l)] = sum;
      }
  }
  for (SpatialMarker &marker : to.markers) {
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
  const Matrix3d spin = data.J_spin * data.spin_axis * data.spin_axis.transpose();
  const Matrix3d inertia = data.J2.trace() * Matrix3d::Identity() - data.J2 + spin;
  for (int i = 0; i < 3; ++i) {
    s0[i] = data.first_moment[i];
    for (int j = 0; j < 3; ++j)
      E0[i][j] = data.J2(i, j), J0[i][j] = inertia(i, j);
  }
  const auto port_count = static_cast<int>(used.size());
  width = 16 + 8 * std::max(port_count - 1, 0);

  // Rows of W and their Gram matrix
  const MatrixXd I = complete_I_bar(data);
  MatrixXd rows = MatrixXd::Zero(width, n);
  if (n) {
    rows.topRows<3>() = data.S_bar;
    rows.row(h) = I.row(5) - I.row(7), rows.row(h + 1) = I.row(6) - I.row(2), rows.row(h + 2) = I.row(1) - I.row(3);
    if (data.h_spin.size())
      rows.middleRows<3>(h) += data.spin_axis * data.h_spin.transpose();
  }
  for (int i = 0; i < port_count; ++i) {
    const SpatialMarker &marker = data.markers[static_cast<std::size_t>(used[static_cast<std::size_t>(i)])];
    Port port;
    port.row = i == 0 ? 6 : 16 + 8 * (i - 1);
    for (int k = 0; k < 3; ++k) {
      port.r[k] = marker.position[k];
      for (int l = 0; l < 3; ++l)
        port.R[k][l] = marker.triad(k, l);
    }
    if (n) {
      rows.middleRows<3>(port.row) = marker.triad.transpose() * marker.Phi.topRows<3>();
      rows.middleRows<3>(port.row + 3) = marker.triad.transpose() * marker.Phi.bottomRows<3>();
      port.is_soft = marker.Phi.cwiseAbs().maxCoeff() > negligible / std::sqrt(mass);
    }
    ports.push_back(port);
  }
  const ExtendedMatrix extended = rows.cast<long double>();
  const ExtendedMatrix gram = n ? ExtendedMatrix(extended * extended.transpose()) : ExtendedMatrix::Zero(width, width);
  W.assign(static_cast<std::size_t>(std::max(n, 1) * width), 0.0), G.resize(static_cast<std::size_t>(width * width));
  for (int r = 0; r < width; ++r) {
    for (int k = 0; k < n; ++k)
      W[static_cast<std::size_t>(k * width + r)] = rows(r, k);
    for (int c = 0; c < width; ++c)
      G[static_cast<std::size_t>(r * width + c)] = static_cast<double>(gram(r, c));
  }

  // What elimination leaves, differences taken in extended precision
  const auto tilde = [](const Vector3d &x) {
    return (Matrix3d() << 0, -x[2], x[1], x[2], 0, -x[0], -x[1], x[0], 0).finished();
  };
  Eigen::Matrix<double, 6, 6> M;
  M << mass * Matrix3d::Identity(), -tilde(data.first_moment), tilde(data.first_moment), inertia;
  for (int r = 0; r < 6; ++r)
    for (int c = 0; c < 6; ++c)
      residual[r][c] = static_cast<double>(M(r, c) - gram(r, c));
  for (int i = 0; i < port_count; ++i) {
    const SpatialMarker &marker = data.markers[static_cast<std::size_t>(used[static_cast<std::size_t>(i)])];
    Port &port = ports[static_cast<std::size_t>(i)];
    const Matrix3d R = marker.triad.transpose();
    Eigen::Matrix<double, 6, 6> X;
    X << R, -R * tilde(marker.position), Matrix3d::Zero(), R;
    for (int r = 0; r < 6; ++r)
      for (int c = 0; c < 6; ++c)
        port.T[r][c] = static_cast<double>(X(r, c) - gram(port.row + r, c));
  }

  K.assign(static_cast<std::size_t>(n + 8), 0.0), D = K;
  for (int k = 0; k < n; ++k)
    K[static_cast<std::size_t>(k)] = data.stiffness[k];
  if (n && data.damping.size() && data.damping.cwiseAbs().maxCoeff() > 0) {
    const bool diagonal = data.damping.cols() == 1 || data.damping.isDiagonal(0);
    if (diagonal) {
      is_damped = true;
      for (int k = 0; k < n; ++k)
        D[static_cast<std::size_t>(k)] = data.damping.cols() == 1 ? data.damping(k, 0) : data.damping(k, k);
    } else
      D_full = data.damping;
  }
  book_blocks(data, I);
}

void Body::book_blocks(const SpatialData &data, const MatrixXd &I) {
  I_bar.assign(static_cast<std::size_t>(9 * n + 8), 0.0);
  if (n == 0)
    return;
  const double reach = std::sqrt(std::max(data.J2.trace(), 1e-300) / std::max(mass, 1e-300));
  std::array<MatrixXd, 9> blocks_;
  std::array<int, 9> filled{};
  for (int k = 0; k < 3; ++k)
    for (int l = 0; l < 3; ++l) {
      const auto slot = static_cast<std::size_t>(3 * k + l);
      has_I_bar[slot] = I.row(3 * k + l).cwiseAbs().maxCoeff() > negligible * reach;
      for (int i = 0; i < n; ++i)
        I_bar[static_cast<std::size_t>((3 * k + l) * n + i)] = I(3 * k + l, i);
      MatrixXd D_kl = data.S_bar_kl[slot].size() ? data.S_bar_kl[slot] : MatrixXd::Zero(n, n);
      if (data.S_spin.size())
        D_kl -= data.spin_booked[k] * data.spin_booked[l] * data.S_spin;
      D_kl = (D_kl.array().abs() > negligible).select(D_kl, 0.0);
      filled[slot] = static_cast<int>((D_kl.array() != 0).count());
      blocks_[slot] = D_kl; // integral of u_k S_l: column i multiplies p_i
    }
  // B^kl_i = I_bar_kl,i + sum over j of (S_bar_lk)_ij p_j, for (S_bar_kl)_ji = integral of S_k,j S_l,i
  const auto is_dense = [&](std::size_t slot) { return filled[slot] * 3 > n * n; };
  for (std::size_t slot = 0; slot < 9; ++slot)
    if (is_dense(slot))
      block[slot] = blocks++;
  dense_blocks = blocks;
  stacked = (dense_blocks * n + 7) / 8 * 8;
  dense.assign(static_cast<std::size_t>(stacked * n), 0.0);
  for (std::size_t slot = 0; slot < 9; ++slot) {
    const MatrixXd &D_kl = blocks_[slot];
    if (filled[slot] == 0)
      continue;
    if (!is_dense(slot))
      block[slot] = blocks++;
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) {
        const double value = D_kl(j, i); // integral of S_k,j S_l,i
        const int row = block[slot] * n + i;
        if (is_dense(slot))
          dense[static_cast<std::size_t>(j * stacked + row)] = value;
        else if (value != 0)
          sparse.push_back({row, j, value});
      }
  }
  for (int c = 0; c < 3; ++c) {
    constexpr std::size_t plus[3] = {5, 6, 1}, minus[3] = {7, 2, 3};
    if (filled[plus[c]] || filled[minus[c]])
      h_moves = h_moves || (blocks_[plus[c]] - blocks_[minus[c]]).cwiseAbs().maxCoeff() > negligible;
  }
}

} // namespace ffrobot::recursion::spatial
