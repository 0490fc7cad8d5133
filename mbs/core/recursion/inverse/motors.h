// What motors and modal forces must do in place of the forces that hold trajectories.
#pragma once

#include "core/linear/dense.h"
#include "core/recursion/motion/motion.h"
#include "core/recursion/newton_euler/newton_euler.h"

namespace ffrobot::recursion {

struct Motor {
  int coordinate; // in v
  double sign;
  bool turns_frames; // in place of the sections, which modes turn against these
};

// A mechanism with what it follows and what acts on it, its motors, and which constraint equations are a path; others
// close loops. Mechanism and scene must outlive whatever is made of it.
template <class Space> struct DrivenMechanism {
  const Mechanism<Space> &mechanism;
  const Scene &scene;
  std::vector<Motor> motors;
  std::vector<char> is_path;  // of all constraint equations
  std::vector<int> of_modes;  // places in v of the modes of all bodies, in the order in which the caller has these
  std::vector<int> of_joints; // of all joint coordinates

  DrivenMechanism(const Mechanism<Space> &mechanism, const Scene &scene, std::vector<Motor> motors,
                  std::vector<char> is_path);
  void check() const; // throws std::invalid_argument where something names what is not there
};

// Generalized forces Q = -C_s^T lambda_s (Shabana 2022, Eq. 13 and below), or any others,
//
//     Q = -C_c^T lambda_c + T^T tau + (0, F_p)
//
// with constraint equations C_c of loops and motors' T: the equations along joints yield lambda_c and tau, those of
// modes F_p. Where loops have more equations than they need, lambda_c is the smallest.
template <class Space> class Motors final : public MotorForces<Space> {
public:
  using TreeWorkspace = Workspace<Space, double>;

  explicit Motors(DrivenMechanism<Space> driven);

  // In place of the multipliers lambda (constraint equations) of a path; of generalized forces Q (n_v). `w` has the
  // kinematics of a state at q, and its frames where constraint equations or cut joints ask for these.
  void resolve(const double *q, const double *lambda, const TreeWorkspace &w);
  void split(const double *q, const VectorXd &Q, const TreeWorkspace &w);
  // After split(): (modes + motors, …) of other forces dQ (n_v, …) what motors and loops leave, as they are then, and
  // tau
  MatrixXd shares_of(const MatrixXd &dQ) const;
  // -C_s^T lambda_s (n_v) of the path
  const VectorXd &path_forces(const double *q, const double *lambda, const TreeWorkspace &w);
  // What the path does on each body alone (dim + n): see NewtonEuler::on_body
  std::vector<VectorXd> path_forces_on_bodies(const double *lambda, const TreeWorkspace &w);

  std::vector<bool> are_moments() const override;
  const VectorXd &find(const double *q, const TreeWorkspace &w) override; // tau()

  const VectorXd &tau() const { return tau_; }        // (motors)
  const VectorXd &left() const { return Q_; }         // (n_v) along modes: F_p
  const VectorXd &beside() const { return beside_; }  // (n_v) the share of left() since motors turn frames
  const VectorXd &loops() const { return lambda_c_; } // (constraint equations of loops)

private:
  void take_path(const double *lambda);                                   // into lambda_
  void project(const double *q, const TreeWorkspace &w, Ref<VectorXd> Q); // of lambda_
  void split(const double *q, const TreeWorkspace &w);                    // Q_
  void close_loops(const double *q, const TreeWorkspace &w);

  const DrivenMechanism<Space> driven_;
  NewtonEuler<Space> forces_;
  std::vector<int> cuts_; // constraint equations of loops; without any, what motors do is known without equations
  VectorXd lambda_, tau_, Q_, beside_, lambda_c_;
  MatrixXd columns_;  // (n_v, cuts, then motors) -C_c^T, T^T
  LeastNorm factors_; // of joint coordinates by cuts, then motors
};

extern template class Motors<Planar>;
extern template class Motors<Spatial>;

} // namespace ffrobot::recursion
