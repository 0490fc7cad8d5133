#include "core/actuation/points.h"

#include <cmath>

namespace ffrobot {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::VectorXd;

VectorXd driving_force(const System &system, const Workspace &w, const std::vector<TrajectoryForce> &forces,
                       const VectorXd &shape_force, std::size_t body) {
  VectorXd gradient(system.coordinates);
  const Index first = system.first_coordinate[body], n = system.bodies[body].modes();
  VectorXd Q_a = VectorXd::Zero(3 + n);
  Q_a.tail(n) = shape_force;
  MeasureMotion motion;
  for (const auto &[constraint, force] : forces) {
    const Measure &row = system.constraints[constraint].row;
    if (row.a.body != static_cast<int>(body) && row.b.body != static_cast<int>(body))
      continue;
    evaluate(row, w.bodies, motion);
    gradient.setZero();
    jacobian(row, motion, system.bodies, w.bodies, system.first_coordinate, gradient);
    Q_a += force * gradient.segment(first, 3 + n);
  }
  return Q_a;
}

ActuationPoints::ActuationPoints(Eigen::Matrix2Xd direction, Eigen::Matrix2Xd position, MatrixXd Phi, VectorXd scale)
    : direction_(std::move(direction)), position_(std::move(position)), Phi_(std::move(Phi)),
      L_a_(3 + Phi_.cols(), direction_.cols()), scale_(std::move(scale)) {
  for (Index k = 0; k < count(); ++k) {
    L_a_.col(k).head<2>() = direction_.col(k);
    L_a_.col(k).tail(Phi_.cols()) = Phi_.middleRows<2>(2 * k).transpose() * direction_.col(k);
  }
}

const MatrixXd &ActuationPoints::L_a(const Eigen::Ref<const VectorXd> &p) {
  for (Index k = 0; k < count(); ++k) {
    const Vector2d u = position_.col(k) + Phi_.middleRows<2>(2 * k) * p;
    L_a_(2, k) = u.x() * direction_(1, k) - u.y() * direction_(0, k);
  }
  return L_a_;
}

const VectorXd &ActuationPoints::solve(double theta, const Eigen::Ref<const VectorXd> &p, VectorXd Q_a) {
  const double c = std::cos(theta), s = std::sin(theta);
  Q_a.head<2>() = Vector2d(c * Q_a[0] + s * Q_a[1], -s * Q_a[0] + c * Q_a[1]).eval();
  scaled_ = scale_.asDiagonal() * L_a(p);
  Q_a.array() *= scale_.array();
  if (scaled_.rows() == scaled_.cols())
    F_a_ = lu_.compute(scaled_).solve(Q_a);
  else
    F_a_ = qr_.compute(scaled_).solve(Q_a);
  return F_a_;
}

Vector2d ActuationPoints::global_force(double theta, Index component) const {
  const double c = std::cos(theta), s = std::sin(theta);
  const Vector2d f = F_a_[component] * direction_.col(component);
  return {c * f.x() - s * f.y(), s * f.x() + c * f.y()};
}

} // namespace ffrobot
