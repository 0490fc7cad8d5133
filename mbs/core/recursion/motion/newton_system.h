// The matrix of Newton's method in implicit integrators (newton/newton.h) at states of a motion: what is stiff, which
// constraint equations it is under, and the posture by which it was factorised last.
#pragma once

#include "core/recursion/motion/scene.h"
#include "core/recursion/newton/newton.h"

#include <complex>

namespace ffrobot::recursion {

template <class Space> class NewtonSystem {
public:
  using Complex = std::complex<double>;

  NewtonSystem(const Mechanism<Space> &mechanism, const Scene &scene); // which must outlive this

  void keep(const std::vector<int> &equations) { w_.keep(equations); } // these alone

  // Diagonals (n_v, then cut joints); damping of friction as at the last factorisation
  const Eigen::VectorXd &stiffness() const { return stiffness_; }
  const Eigen::VectorXd &damping() const { return damping_; }
  const Eigen::MatrixXd &coupling() const { return coupling_; } // (n_v, cut joints) their rates are coupling^T v

  void set_state(const double *q, const double *v); // by which the next factorisations go
  void factorise(double damping_factor, double stiffness_factor);
  void factorise(Complex damping_factor, Complex stiffness_factor);
  void solve(const double *r, const double *c, double *x); // as ImplicitSystem has these
  void solve(const Complex *r, Complex *x);
  void constrain(const double *x, double *c);

  Workspace<Space, double> &workspace() { return w_; } // of the posture, at rest

private:
  void find_stiff_terms();
  void take_friction(const Eigen::VectorXd &rates);
  void take_posture();
  void find_coupling();
  template <class Scalar>
  void factorise(NewtonMatrix<Space, Scalar> &matrix, Scalar damping_factor, Scalar stiffness_factor);
  template <class Scalar> void spread(const Scalar *r, Scalar *x) const;

  const Mechanism<Space> &mechanism_;
  const Scene &scene_;
  Workspace<Space, double> w_;
  NewtonPosture<Space> posture_;
  bool posture_is_old_ = true; // the state is newer
  Eigen::VectorXd q_, v_, stiffness_, damping_;
  Eigen::MatrixXd coupling_;
  std::vector<Eigen::Index> turned_; // stiff coordinates along pins whose section modes turn
  Eigen::MatrixXd C_;                // (kept equations, cut joints, turned_; n_v)
  NewtonMatrix<Space, double> real_;
  NewtonMatrix<Space, Complex> complex_;
};

extern template class NewtonSystem<Planar>;
extern template class NewtonSystem<Spatial>;

} // namespace ffrobot::recursion
