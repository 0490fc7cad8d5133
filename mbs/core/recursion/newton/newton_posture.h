// What matrices of Newton's method (newton_tree.h) are made of at a posture: bodies at rest, p not yet eliminated, and
// the gradients of constraints.
#pragma once

#include "core/recursion/constrained_aba/workspace.h"

#include <Eigen/Core>

#include <vector>

namespace ffrobot::recursion {

// A = (a, alpha) of the frame, of ports and sections as in backward_pass.h. "Linked" ports come first: those on which
// a node has its joint, then the inboard one.
template <class Space> struct NewtonBody {
  static constexpr int d = Space::dim;
  using Square = Eigen::Matrix<double, d, d>;
  using Joint = Eigen::Matrix<double, d, Eigen::Dynamic, Eigen::ColMajor, d, d>;

  std::vector<int> ports;    // of the body
  std::vector<int> children; // nodes on the first of them
  bool is_moved = false;     // by modes, at the inboard port, which is linked behind the children's

  Eigen::MatrixXd rows;   // (d (1 + ports), n) m of the frame, then P of ports
  Eigen::MatrixXd m_ff;   // (n, n); empty: the identity
  Eigen::MatrixXd p_by_A; // (n, d) m_ff^-1 m^T where modes are not orthonormal; else m^T is
  Square M;               // M_rr - m m_ff^-1 m^T
  std::vector<Square> X;  // of ports: X_rigid - P m_ff^-1 m^T
  Square tilt;            // undeformed axes of the inboard port by those of the section
  Square to_section;      // A of the section by that of the inboard port, the joint locked
  Joint J;                // A of the section by accelerations of the joint
  Eigen::VectorXd turn; // (n) Phi_r of a pin's section that modes turn: A = … + J (q_ddot - turn . p_ddot); else empty

  int linked() const { return static_cast<int>(children.size()) + (is_moved ? 1 : 0); }
  Eigen::Index modes() const { return rows.cols(); }
  auto P(std::size_t port) const { return rows.middleRows<d>(d * (1 + static_cast<Eigen::Index>(port))); }
};

template <class Space> class NewtonPosture {
public:
  explicit NewtonPosture(const Mechanism<Space> &mechanism);

  // At q (n_q), with the ground's markers as w has them, which becomes one at rest.
  void take(const double *q, Workspace<Space, double> &w);

  const Mechanism<Space> &mechanism() const { return mechanism_; }
  const NewtonBody<Space> &body(std::size_t node) const { return bodies_[node]; }
  const Eigen::MatrixXd &gradients() const { return C_; } // (constraints, n_v) C_q

private:
  static constexpr int d = Space::dim;
  using Forces = Eigen::Matrix<double, d, Eigen::Dynamic>;

  void take_body(std::size_t node, const double *q, Workspace<Space, double> &w);
  void take_joint(std::size_t node, const double *q, const Workspace<Space, double> &w);
  void act(const Workspace<Space, double> &w);
  void find_gradients(const Workspace<Space, double> &w);

  const Mechanism<Space> &mechanism_;
  std::vector<NewtonBody<Space>> bodies_;
  Eigen::MatrixXd C_;
  Eigen::VectorXd rest_;       // (n_v) zeros
  std::vector<Forces> acting_; // of each port (d, constraints), in its axes: of unit multipliers, of the subtree
};

extern template class NewtonPosture<Planar>;
extern template class NewtonPosture<Spatial>;

} // namespace ffrobot::recursion
