// The matrix of Newton's method in implicit integrators, N = M + B^T E B under C_q: E is a diagonal, zero but at a few
// stiff coordinates B x: modes, joints with springs or friction, joints at which loops are cut, and twists of gears. N
// is never made; what evaluations at rest say suffices, with G = B P and forces f = r - E B x:
//     N x + C_q^T nu = B^T r, C_q x = c:     x = P f + R c,     B x = G f + B R c
// P (n_v, stiff) are accelerations by unit forces along these coordinates while the constraint equations hold, R (n_v,
// equations) those by which an equation alone accelerates. With S S = E, the matrix for f / S is symmetric:
//     (1 + S G S) f / S = r / S - S B R c
// Where E is large f is next to nothing beside r: r - E B x would be round-off of r.
#pragma once

#include "core/integrate/ode.h"
#include "core/recursion/motion/scene.h"

namespace ffrobot::recursion {

template <class Space> class NewtonSystem : public OdeSystem {
public:
  // Diagonals (n_v, cut joints, gears); slopes of friction and of gears as at the last linearise()
  const VectorXd &stiffness() const final { return stiffness_; }
  const VectorXd &damping() const final { return damping_; }
  const MatrixXd &coupling() const final { return coupling_; } // (n_v, cut joints and gears), rates: coupling^T v

  void factorise(double of_damping, double of_stiffness) final { factorise(of_damping, of_stiffness, real_); }
  void factorise(Complex of_damping, Complex of_stiffness) final { factorise(of_damping, of_stiffness, complex_); }
  void solve(const double *r, const double *c, double *x) final;
  void solve(const Complex *r, Complex *x) final;
  void constrain(const double *x, double *c) final;

protected:
  NewtonSystem(const Mechanism<Space> &mechanism, const Scene &scene); // which must outlive this
  void linearise_at(const double *q, const double *v);

  const Mechanism<Space> &mechanism_;
  const Scene &scene_;
  Workspace<Space, double> at_rest_; // for evaluations at rest, of the constraint equations that are kept

private:
  template <class Scalar> using Vector = Matrix<Scalar, Dynamic, 1>;
  template <class Scalar> struct Factors {
    Vector<Scalar> S;                           // (stiff)
    Matrix<Scalar, Dynamic, Dynamic> symmetric; // 1 + S G S as L and 1/D (symmetric_factors.h)
  };

  void take_slopes(const VectorXd &rates);
  void find_coupling();
  void find_responses();
  template <class Matrix> Matrix along_stiff(const Matrix &x) const; // B x
  template <class Scalar>
  void factorise(Scalar damping_factor, Scalar stiffness_factor, Factors<Scalar> &factors) const;
  template <class Scalar> void solve(const Factors<Scalar> &factors, const Scalar *r, Map<Vector<Scalar>> x) const;

  VectorXd q_, rest_, stiffness_, damping_; // (n_q), (n_v) zeros
  MatrixXd coupling_;
  std::vector<Index> stiff_, free_; // of the diagonals: entries that may not be zero, ascending; others
  MatrixXd P_, G_, R_;              // P (free, stiff); R of all equations, zero of those that are not kept
  Factors<double> real_;
  Factors<Complex> complex_;
};

} // namespace ffrobot::recursion
