#include "core/body/moving_rows.h"

namespace ffrobot {

using Eigen::Index;
using VectorMap = Eigen::Map<const Eigen::VectorXd>;

namespace {

// m_thetaf = h + p^T S_tilde replaces the row h of W where S_tilde is not zero.
void update_rotation_row(const PlanarBody &body, const double *p, PlanarBodyState &s) {
  s.W.row(2).noalias() = body.W.row(2) + VectorMap(p, body.modes()).transpose() * body.S_tilde;
  s.rows.replace(2, s.W.row(2));
}

// S_bar(p), m_thetaf and the rows of m_ff of a body with geometric stiffening, and what W(p) p has too little.
void update_affine_rows(const PlanarBody &body, const double *p, const double *p_dot, PlanarBodyState &s) {
  AffineMotion &motion = s.affine;
  const Index n = body.modes(), first = body.affine_row(), count = body.affine.row_count();
  update(body.affine, p, p_dot, motion);
  Eigen::Matrix<double, 8, 1> x;
  coupling(body.affine, motion, x.data());
  body.affine.rows(motion.F, s.W.bottomRows(count));
  s.W.topRows<2>() = motion.F.topRows<2>();
  s.W.row(2).noalias() = x.head(count).transpose() * s.W.bottomRows(count);
  if (body.S_tilde.size())
    s.W.row(2) += VectorMap(p, n).transpose() * body.S_tilde;
  for (Index row = 0; row < 3; ++row)
    s.rows.replace(row, s.W.row(row));
  for (Index row = first; row < first + body.affine.moving; ++row)
    s.rows.replace(row, s.W.row(row));
  s.displacement.head<2>() = (motion.g - body.affine.N.col(2)).head<2>() - motion.F.topRows<2>() * VectorMap(p, n);
  s.convective.head<2>() = motion.curvature.head<2>();
}

// W(p) = W - (K p)^T at markers
void update_second_order(const PlanarBody &body, const double *p, const double *p_dot, PlanarBodyState &s) {
  const Index n = body.modes();
  const VectorMap p_(p, n), p_dot_(p_dot, n);
  for (const auto &[row, K] : body.second_order) {
    const Index place = s.rows.place[static_cast<std::size_t>(row)];
    s.curvature.noalias() = K * p_;
    s.W.row(row) = body.W.row(row) - s.curvature.transpose();
    s.rows.replace(row, s.W.row(row));
    s.displacement[place] = 0.5 * s.curvature.dot(p_); // what W(p) p has too little
    s.curvature.noalias() = K * p_dot_;
    s.convective[place] = s.curvature.dot(p_dot_);
  }
}

} // namespace

void update_moving_rows(const PlanarBody &body, const double *p, const double *p_dot, PlanarBodyState &s) {
  if (!body.is_stiffened()) {
    if (body.S_tilde.size())
      update_rotation_row(body, p, s);
    return;
  }
  s.displacement.setZero();
  update_second_order(body, p, p_dot, s);
  update_affine_rows(body, p, p_dot, s);
  s.rows.reduce(body.affine.C_inverse);
  factorise_translation(body.mass, s);
}

void factorise_translation(double mass, PlanarBodyState &s) {
  const Eigen::MatrixXd &G = s.rows.G;
  s.D_inverse[0] = 1 / (mass - G(0, 0));
  s.L[0] = -G(1, 0) * s.D_inverse[0];
  s.D_inverse[1] = 1 / (mass - G(1, 1) + s.L[0] * G(1, 0));
}

} // namespace ffrobot
