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

// W(p) = W - (K p)^T; after update_rotation_row, which writes row 2 anew.
void update_second_order(const PlanarBody &body, const double *p, const double *p_dot, PlanarBodyState &s) {
  const Index n = body.modes();
  const VectorMap p_(p, n), p_dot_(p_dot, n);
  s.displacement.setZero();
  for (const auto &[row, K] : body.second_order) {
    const Index place = s.rows.place[static_cast<std::size_t>(row)];
    s.curvature.noalias() = K * p_;
    if (row != 2 || body.S_tilde.size() == 0)
      s.W.row(row) = body.W.row(row);
    s.W.row(row) -= s.curvature.transpose();
    s.rows.replace(row, s.W.row(row));
    s.displacement[place] = 0.5 * s.curvature.dot(p_); // what W(p) p has too little
    s.curvature.noalias() = K * p_dot_;
    s.convective[place] = s.curvature.dot(p_dot_);
  }
  factorise_translation(body.mass, s);
}

} // namespace

void update_moving_rows(const PlanarBody &body, const double *p, const double *p_dot, PlanarBodyState &s) {
  if (body.S_tilde.size())
    update_rotation_row(body, p, s);
  if (!body.second_order.empty())
    update_second_order(body, p, p_dot, s);
}

void factorise_translation(double mass, PlanarBodyState &s) {
  const Eigen::MatrixXd &G = s.rows.G;
  s.D_inverse[0] = 1 / (mass - G(0, 0));
  s.L[0] = -G(1, 0) * s.D_inverse[0];
  s.D_inverse[1] = 1 / (mass - G(1, 1) + s.L[0] * G(1, 0));
}

} // namespace ffrobot
