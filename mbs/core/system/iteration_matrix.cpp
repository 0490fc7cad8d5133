#include "core/system/iteration_matrix.h"

#include <Eigen/LU>

#include <complex>

namespace ffrobot {

using Eigen::Index;

namespace {

template <class Vector> void rotate(double c, double s, Vector &v) {
  const auto x = v[0];
  v[0] = c * x - s * v[1];
  v[1] = s * x + c * v[1];
}

} // namespace

template <class Scalar>
IterationMatrix<Scalar>::IterationMatrix(const System &system)
    : system_(system), rows_(system.rows.size()), schur_(system.envelope),
      nu_(Vector::Zero(static_cast<Index>(system.rows.size()))) {
  for (const auto &body : system.bodies) {
    Body &b = bodies_.emplace_back();
    b.W = body.W;
    b.C = body.affine.C;
    b.e_inverse = b.u = Vector::Zero(body.modes());
    b.G = Matrix::Zero(b.W.rows(), b.W.rows());
    b.Wu = b.z = Vector::Zero(b.W.rows());
    b.B.resize(body.marker_positions.size());
    b.arm.resize(b.B.size());
    b.motion.resize(b.B.size());
    b.wrench.setZero(3, body.markers());
  }
}

// m_ff + c D_ff + d K_ff = E^-1 + U^T C U of a body with geometric stiffening (PackedRows::reduce)
template <class Scalar> void IterationMatrix<Scalar>::reduce(const PlanarBody &body, Body &b) {
  const Index first = body.affine_row(), rank = body.affine.rank();
  b.G.noalias() = (b.W.template cast<Scalar>() * b.e_inverse.asDiagonal()) * b.W.transpose();
  const Matrix with_U = b.G.middleCols(first, rank);
  b.S.compute(body.affine.C_inverse.template cast<Scalar>() + with_U.middleRows(first, rank));
  b.G.noalias() -= with_U * b.S.solve(with_U.transpose());
}

template <class Scalar>
void IterationMatrix<Scalar>::factorise_body(const PlanarBody &body, const PlanarBodyState &state, Body &b) {
  const auto update = [&](Index row) {
    b.G.row(row).noalias() = (b.W.row(row).template cast<Scalar>() * b.e_inverse.asDiagonal()) * b.W.transpose();
    b.G.col(row) = b.G.row(row).transpose();
  };
  if (body.S_tilde.size() || body.is_stiffened())
    b.W = state.W;
  if (body.affine)
    reduce(body, b);
  else if (body.S_tilde.size())
    update(2);
  b.cosine = state.cosine;
  b.sine = state.sine;
  Matrix3 frame = -b.G.template topLeftCorner<3, 3>();
  frame(0, 0) += body.mass;
  frame(1, 1) += body.mass;
  frame(2, 2) += state.inertia;
  frame(0, 2) -= state.moment.y();
  frame(2, 0) -= state.moment.y();
  frame(1, 2) += state.moment.x();
  frame(2, 1) += state.moment.x();
  b.frame_inverse = frame.inverse();
  for (std::size_t k = 0; k < b.B.size(); ++k) {
    const Eigen::Vector2d &global = b.arm[k] = state.markers[k].arm;
    const Eigen::Vector2d arm(b.cosine * global.x() + b.sine * global.y(),
                              -b.sine * global.x() + b.cosine * global.y());
    b.B[k] = Matrix3::Identity() - b.G.template block<3, 3>(3 + 3 * static_cast<Index>(k), 0);
    b.B[k](0, 2) -= arm.y();
    b.B[k](1, 2) += arm.x();
  }
}

template <class Scalar> auto IterationMatrix<Scalar>::mobility(const Body &b, Index k, Index l) const -> Matrix3 {
  const auto &B_k = b.B[static_cast<std::size_t>(k)], &B_l = b.B[static_cast<std::size_t>(l)];
  Matrix3 E = b.G.template block<3, 3>(3 + 3 * k, 3 + 3 * l) + B_k * b.frame_inverse * B_l.transpose();
  for (Index j = 0; j < 3; ++j) {
    auto column = E.col(j);
    rotate(b.cosine, b.sine, column);
  }
  for (Index i = 0; i < 3; ++i) {
    auto row = E.row(i);
    rotate(b.cosine, b.sine, row);
  }
  return E;
}

template <class Scalar>
void IterationMatrix<Scalar>::factorise(const Workspace &w, const Eigen::VectorXd &damping, Scalar damping_factor,
                                        const Eigen::VectorXd &stiffness, Scalar stiffness_factor) {
  const bool same = damping_factor == damping_factor_ && stiffness_factor == stiffness_factor_;
  damping_factor_ = damping_factor;
  stiffness_factor_ = stiffness_factor;
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    Body &b = bodies_[i];
    const Index first = system_.first_coordinate[i] + 3, n = system_.bodies[i].modes();
    if (!same) {
      for (Index k = 0; k < n; ++k)
        b.e_inverse[k] =
            Scalar(1) / (Scalar(1) + damping_factor * damping[first + k] + stiffness_factor * stiffness[first + k]);
      b.G.noalias() = (b.W.template cast<Scalar>() * b.e_inverse.asDiagonal()) * b.W.transpose();
    }
    factorise_body(system_.bodies[i], w.bodies[i], b);
  }
  rows_ = w.rows;
  schur_.set_zero();
  Matrix3 E;
  const System::Coupling *at = nullptr; // E is its mobility
  for (const auto &c : system_.couplings) {
    const MeasureMotion &r = rows_[static_cast<std::size_t>(c.r)], &s = rows_[static_cast<std::size_t>(c.s)];
    const auto &cr = c.r_is_b ? r.coefficient_b : r.coefficient_a;
    const auto &cs = c.s_is_b ? s.coefficient_b : s.coefficient_a;
    if (!at || at->body != c.body || at->k != c.k || at->l != c.l)
      E = mobility(bodies_[static_cast<std::size_t>(c.body)], c.k, c.l);
    at = &c;
    const Vector3 image = E * cs;
    *schur_.entry(c.r, c.s) += cr[0] * image[0] + cr[1] * image[1] + cr[2] * image[2];
  }
  auto i = static_cast<Index>(system_.n_bilateral());
  for (const Rotor &rotor : system_.rotors) {
    *schur_.entry(i, i) += rotor.compliance;
    ++i;
  }
  schur_.factorise();
}

template <class Scalar> void IterationMatrix<Scalar>::free_response(const Scalar *r, Body &b) {
  b.u = b.e_inverse.cwiseProduct(Eigen::Map<const Vector>(r + 3, b.u.size()));
  if (const Index rank = b.C.rows()) {
    const auto U = b.W.middleRows(3 + 3 * static_cast<Index>(b.B.size()), rank);
    const Vector reaction = b.S.solve(U * b.u);
    b.u -= b.e_inverse.cwiseProduct(U.transpose() * reaction);
  }
  b.Wu.noalias() = b.W * b.u;
  b.frame.noalias() = -b.frame_inverse * b.Wu.template head<3>();
  b.wrench.setZero();
  for (std::size_t k = 0; k < b.B.size(); ++k) {
    b.motion[k] = b.B[k] * b.frame + b.Wu.template segment<3>(3 + 3 * static_cast<Index>(k));
    rotate(b.cosine, b.sine, b.motion[k]);
  }
}

template <class Scalar> Scalar IterationMatrix<Scalar>::along_row(std::size_t i) const {
  const Measure &row = system_.rows[i];
  Scalar sum(0);
  for (const auto &[m, h] : {std::pair(&row.b, &rows_[i].coefficient_b), std::pair(&row.a, &rows_[i].coefficient_a)})
    if (m->body >= 0) {
      const Vector3 &x = bodies_[static_cast<std::size_t>(m->body)].motion[static_cast<std::size_t>(m->marker)];
      sum += (*h)[0] * x[0] + (*h)[1] * x[1] + (*h)[2] * x[2];
    }
  return sum;
}

template <class Scalar> void IterationMatrix<Scalar>::constrain(const Scalar *x, Scalar *c) {
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    Body &b = bodies_[i];
    const Scalar *q = x + system_.first_coordinate[i];
    b.Wu.noalias() = b.W * Eigen::Map<const Vector>(q + 3, b.u.size());
    for (std::size_t k = 0; k < b.motion.size(); ++k) {
      b.motion[k] = b.Wu.template segment<3>(3 + 3 * static_cast<Index>(k));
      rotate(b.cosine, b.sine, b.motion[k]);
      b.motion[k] += Vector3(q[0] - b.arm[k].y() * q[2], q[1] + b.arm[k].x() * q[2], q[2]);
    }
  }
  for (std::size_t i = 0; i < rows_.size(); ++i)
    c[i] = i < system_.n_bilateral() ? along_row(i) : Scalar(0);
}

template <class Scalar> void IterationMatrix<Scalar>::solve(const Scalar *r, const Scalar *c, Scalar *x) {
  for (std::size_t i = 0; i < bodies_.size(); ++i)
    free_response(r + system_.first_coordinate[i], bodies_[i]);
  for (std::size_t i = 0; i < rows_.size(); ++i)
    nu_[static_cast<Index>(i)] = along_row(i) - (c ? c[i] : Scalar(0));
  schur_.solve(nu_.data());
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    const Measure &row = system_.rows[i];
    for (const auto &[m, h] : {std::pair(&row.b, &rows_[i].coefficient_b), std::pair(&row.a, &rows_[i].coefficient_a)})
      if (m->body >= 0)
        bodies_[static_cast<std::size_t>(m->body)].wrench.col(m->marker) -= nu_[static_cast<Index>(i)] * *h;
  }
  for (std::size_t i = 0; i < bodies_.size(); ++i) {
    Body &b = bodies_[i];
    Vector3 force = Vector3::Zero();
    for (Index k = 0; k < b.wrench.cols(); ++k) {
      Vector3 f = b.wrench.col(k);
      rotate(b.cosine, -b.sine, f);
      force += b.B[static_cast<std::size_t>(k)].transpose() * f;
      b.z.template segment<3>(3 + 3 * k) = f;
    }
    Vector3 frame = b.frame + b.frame_inverse * force;
    b.z.template head<3>() = -frame;
    if (const Index rank = b.C.rows()) {
      const Index first = 3 + 3 * b.wrench.cols();
      b.z.segment(first, rank).setZero();
      const Vector U_z = b.G.middleRows(first, rank) * b.z;
      b.z.segment(first, rank) = -b.C * U_z;
    }
    Scalar *out = x + system_.first_coordinate[i];
    Eigen::Map<Vector> x_p(out + 3, b.u.size());
    x_p.noalias() = b.W.transpose() * b.z;
    x_p = b.u + b.e_inverse.cwiseProduct(x_p);
    rotate(b.cosine, b.sine, frame);
    std::copy_n(frame.data(), 3, out);
  }
}

template class IterationMatrix<double>;
template class IterationMatrix<std::complex<double>>;

} // namespace ffrobot
