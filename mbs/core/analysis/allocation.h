// Voltages within limits: bounded weighted least squares, warm-started from one time to the next.
#pragma once

#include "core/eigen.h"
#include <Eigen/QR>
#include <vector>

namespace ffrobot {

// Minimises |W_sqrt (F - Phi V)|^2 over lower <= V <= upper, 0 among them. Always has a solution; where it is not
// unique, the smallest voltages relative to `scale` are picked.
//
// Active sets (P. B. Stark and R. L. Parker, Comput. Stat. 10, 1995: BVLS): voltages at a limit are held there, the
// others go to their minimum or to the first limit on the way; then the one that presses most against the inner side of
// its limit is let go. Ends after finitely many changes; from one time to the next there are few. QR finds the free
// voltages: in normal equations round-off scatters those that are hardly unique, and steps of any length err by that.
class Allocation {
public:
  // Phi: (n, k) modal forces per volt; W_sqrt: (rows, n); gain: (k, n) the best voltages without limits, V = gain F,
  // which are taken wherever they are within the limits (of many the smallest relative to scale, so that V does not
  // jump where the first limit is met); lower, upper: (k), infinite where there is none; scale: (k) ordinary voltages.
  Allocation(MatrixXd Phi, const MatrixXd &W_sqrt, MatrixXd gain, VectorXd lower, VectorXd upper, VectorXd scale);

  // Voltages (k) for the modal forces F (n).
  const VectorXd &solve(const Ref<const VectorXd> &F);

  const MatrixXd &Phi() const { return Phi_; }
  unsigned long iterations() const { return iterations_; }

private:
  double bound(Index j, double side) const { return (side > 0 ? upper_ : lower_)[j] / scale_[j]; } // of u
  bool move();
  void minimise();
  bool release();

  MatrixXd Phi_, gain_, W_sqrt_, A_; // A u = d with u = V / scale: W_sqrt Phi scale u = W_sqrt F, ridge u = 0
  VectorXd lower_, upper_, scale_;
  VectorXd V_, u_, d_, left_, gradient_, target_; // left: d - A u
  std::vector<int> held_;                         // sign of the limit at which a voltage is held, 0 where free
  std::vector<Index> free_, factorised_;
  Eigen::HouseholderQR<MatrixXd> qr_{MatrixXd::Identity(1, 1)}; // copied before it is of anything
  unsigned long iterations_ = 0;
};

} // namespace ffrobot
