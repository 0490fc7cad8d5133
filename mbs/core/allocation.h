// Voltages within limits: bounded weighted least squares, warm-started from one time to the next.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <vector>

namespace ffrobot {

// Minimises |W_sqrt (F - Phi V)|^2 over -limit <= V <= limit. Always has a solution; where it is not unique, the
// smallest voltages relative to `scale` are picked.
//
// Projected Newton method (D. P. Bertsekas, SIAM J. Control Optim. 20, 1982): voltages at a limit that want to go
// beyond it are held there, the others take the Newton step of the quadratic, cut at the limits. Near the solution
// the held set no longer changes and one step is exact, so that a warm start costs one or two solves.
class Allocation {
public:
  // Phi: (n, k) modal forces per volt; W_sqrt: (rows, n); gain: (k, n) the best voltages without limits, V = gain F,
  // which are taken wherever they are within the limits (of many the smallest relative to scale, so that V does not
  // jump where the first limit is met); limit: (k), infinite where there is none; scale: (k) ordinary voltages.
  Allocation(Eigen::MatrixXd Phi, const Eigen::MatrixXd &W_sqrt, Eigen::MatrixXd gain, Eigen::VectorXd limit,
             Eigen::VectorXd scale);

  // Voltages (k) for the modal forces F (n).
  const Eigen::VectorXd &solve(const Eigen::Ref<const Eigen::VectorXd> &F);

  const Eigen::MatrixXd &Phi() const { return Phi_; }
  unsigned long iterations() const { return iterations_; }

private:
  bool hold(); // which voltages stay at their limit, and the others' Hessian; true where that is as before
  bool step(); // Newton step of the free voltages, cut at the limits; true where it was taken in full
  // The free voltages from the held ones alone, so that V does not depend on where the iteration began: noise would
  // look like an error of the integrator that no step is short enough for. Takes back what the ridge has cost.
  void finish();
  void solve_free(); // free_step: the gradient through the Hessian of the free voltages
  double cost(const Eigen::VectorXd &u) const { return u.dot(0.5 * (H_ * u) - b_); }

  Eigen::MatrixXd Phi_, gain_, H_, back_; // in u = V / scale: H = A^T A, b = back F with A = W_sqrt Phi scale
  Eigen::VectorXd limit_, scale_, bound_; // bound: limits of u
  Eigen::VectorXd V_, u_, b_, gradient_, trial_, free_step_;
  std::vector<Eigen::Index> free_, factorised_;
  Eigen::LLT<Eigen::MatrixXd> llt_;
  double ridge_ = 0;
  unsigned long iterations_ = 0;
};

} // namespace ffrobot
