// Voltages within limits: bounded weighted least squares, warm-started from one time to the next.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <vector>

namespace ffrobot {

// Minimises |W_sqrt (F - Phi V)|^2 over -limit <= V <= limit. Always has a solution; where it is not unique, the
// smallest voltages relative to their limits are picked.
//
// Projected Newton method (D. P. Bertsekas, SIAM J. Control Optim. 20, 1982): voltages at a limit that want to go
// beyond it are held there, the others take the Newton step of the quadratic, cut at the limits. Near the solution
// the held set no longer changes and one step is exact, so that a warm start costs one or two solves.
class Allocation {
public:
  // Phi: (n, k) modal forces per volt; W_sqrt: (rows, n); gain: (k, n) the best voltages without limits, V = gain F,
  // which are taken wherever they are within the limits; limit: (k), infinite where there is none.
  Allocation(Eigen::MatrixXd Phi, const Eigen::MatrixXd &W_sqrt, Eigen::MatrixXd gain, Eigen::VectorXd limit);

  // Voltages (k) for the modal forces F (n).
  const Eigen::VectorXd &solve(const Eigen::Ref<const Eigen::VectorXd> &F);

  const Eigen::MatrixXd &Phi() const { return Phi_; }
  unsigned long iterations() const { return iterations_; }

private:
  void hold(); // updates which voltages stay at their limit, and the factorisation of the others' Hessian
  void step(); // Newton step of the free voltages, cut at the limits
  double cost(const Eigen::VectorXd &u) const { return u.dot(0.5 * (H_ * u) - b_); }

  Eigen::MatrixXd Phi_, gain_, H_, back_; // in u = V / limit: H = A^T A, b = back F with A = W_sqrt Phi limit
  Eigen::VectorXd limit_, scale_;         // scale: V = scale u, the limit where it is finite
  Eigen::VectorXd V_, u_, b_, gradient_, trial_, free_step_;
  std::vector<Eigen::Index> free_, factorised_;
  Eigen::LLT<Eigen::MatrixXd> llt_;
  unsigned long iterations_ = 0;
};

} // namespace ffrobot
