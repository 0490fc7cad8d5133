// What motors and modal forces must do in place of the forces that hold a trajectory, in joint coordinates.
#pragma once

#include "core/analysis/system_on_tree.h"
#include "core/recursion/newton_euler.h"

#include <Eigen/LU>

namespace ffrobot {

// Q_a = -C_sq^T lambda_s (Shabana 2022, Eq. 13 and below) along joints and modes,
//
//     -C_s^T lambda_s = C_c^T nu + T^T tau + (0, F_p)
//
// with rows C_c where loops are cut and motors' T: the rows of joint coordinates give nu and tau, those of modes F_p.
// Needs as many motors as the mechanism with rigid links has degrees of freedom.
class MotorsOnTree final : public recursion::MotorForces<recursion::Planar> {
public:
  explicit MotorsOnTree(const SystemOnTree &both); // which must outlive this

  // For multipliers lambda (rows of the tree), at the state of the accelerations() of w.
  void resolve(const double *q, const double *lambda, const recursion::Workspace<recursion::Planar, double> &w);

  std::vector<bool> are_moments() const override;
  const Eigen::VectorXd &find(const double *q,
                              const recursion::Workspace<recursion::Planar, double> &w) override; // tau()

  const Eigen::VectorXd &tau() const { return tau_; }                              // (motors)
  const std::vector<Eigen::VectorXd> &modal_force() const { return modal_force_; } // F_p of each body of the system

private:
  using TreeWorkspace = recursion::Workspace<recursion::Planar, double>;
  // Of rows with -lambda, into Q (n_v)
  void project(const double *q, const TreeWorkspace &w, Eigen::Ref<Eigen::VectorXd> Q);
  void close_loops(const double *q, const TreeWorkspace &w);
  void add_motor(Eigen::Index k, const double *q, const TreeWorkspace &w); // its column
  void turn_frames(int coordinate, double moment, const TreeWorkspace &w);

  const SystemOnTree &both_;
  recursion::NewtonEuler<recursion::Planar> forces_;
  std::vector<int> joint_coordinates_, cuts_; // in v; rows of the tree
  bool is_along_coordinates_ = true;          // all motors: what they do is known without equations, but for cuts
  Eigen::VectorXd lambda_, tau_, Q_;          // (rows), (motors), (n_v)
  std::vector<Eigen::VectorXd> modal_force_;
  Eigen::MatrixXd columns_;                 // (n_v, cuts, then motors) -C_c^T, T^T
  Eigen::PartialPivLU<Eigen::MatrixXd> lu_; // of joint coordinates by cuts, then motors
};

} // namespace ffrobot
