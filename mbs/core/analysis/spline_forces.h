// Forces between times at which they are known: splines of degree 5 through them (de Boor, A Practical Guide to
// Splines, 2001, ch. X and XIII).
#pragma once

#include "core/analysis/force_source.h"

#include <functional>
#include <vector>

namespace ffrobot {

// Of all numbers, without jumps.
class Spline {
public:
  using Values = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

  // Through values (n, numbers) at ascending nodes (n); degree n - 1 where they are fewer than 6. All nodes but the two
  // next to each end are knots.
  Spline(const std::vector<double> &nodes, Values values);

  double end() const { return knots_.back(); }
  void evaluate(double t, double *to); // (numbers); those at the nearer end beyond them

  // Of each interval between the nodes (n - 1): the largest estimated error of any number, relative to its size.
  Eigen::VectorXd errors(const std::vector<double> &nodes, const Eigen::RowVectorXd &sizes) const;

private:
  static constexpr int most = 5; // degree

  void find_interval(double t); // between knots
  void find_basis(double t);    // there
  void solve(const std::vector<double> &nodes);

  int degree_;
  std::vector<double> knots_;
  Values coefficients_; // (n, numbers)
  std::size_t interval_;
  double basis_[most + 1];
};

class SplineForces final : public ForceSource {
public:
  using Sample = std::function<void(double t, double *read)>;
  using Finish = std::function<void(const double *read, double *to)>;

  // Of `read` numbers, which jump between times that are next to each other, and from which `finish` makes `count`.
  // Further samples are taken where splines are off by more than `error`, relative to the mean size of each number.
  SplineForces(const std::vector<double> &times, Eigen::Index read, const Sample &sample, double error,
               Eigen::Index count, Finish finish);

private:
  void find(double t) override;

  std::vector<Spline> pieces_; // between jumps
  std::size_t piece_ = 0;
  Eigen::VectorXd read_;
  Finish finish_;
};

} // namespace ffrobot
