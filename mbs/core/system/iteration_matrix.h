// The matrix of Newton's method in implicit integrators, N = M + damping_factor D + stiffness_factor K under C_q.
//
// Its p-blocks are diagonal, e = 1 + damping_factor d + stiffness_factor k, so it is eliminated as the mass matrix is
// in planar_body.h and system.h, with W e^-1 W^T in place of W W^T. Off-diagonal damping is left to the iteration.
// Where geometric stiffening adds U^T C U to m_ff, (e + U^T C U)^-1 stands for e^-1.
#pragma once

#include "core/constraint/envelope.h"
#include "core/system/system.h"

#include <Eigen/Core>
#include <Eigen/LU>

#include <cmath>
#include <vector>

namespace ffrobot {

template <class Scalar> class IterationMatrix {
public:
  using Vector = Eigen::Matrix<Scalar, Eigen::Dynamic, 1>;
  using Matrix = Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>;
  using Vector3 = Eigen::Matrix<Scalar, 3, 1>;
  using Matrix3 = Eigen::Matrix<Scalar, 3, 3>;

  explicit IterationMatrix(const System &system);

  // stiffness and damping: diagonals over all coordinates; geometry: of the last evaluation in w.
  void factorise(const Workspace &w, const Eigen::VectorXd &damping, Scalar damping_factor,
                 const Eigen::VectorXd &stiffness, Scalar stiffness_factor);

  // N x + C_q^T nu = r, C_q x = c: r (coordinates) of modal forces alone, c (constraints) or null for zero.
  void solve(const Scalar *r, const Scalar *c, Scalar *x);

  // c = C_q x, zero for rotors
  void constrain(const Scalar *x, Scalar *c);

private:
  struct Body {
    Eigen::MatrixXd W;             // rows of the body as at the last factorisation
    Eigen::MatrixXd C;             // of U, the rows behind those of markers; empty without geometric stiffening
    Eigen::PartialPivLU<Matrix> S; // C^-1 + U e^-1 U^T
    double cosine = 1, sine = 0;
    std::vector<Eigen::Vector2d> arm; // of each marker, global
    Vector e_inverse;                 // (n)
    Matrix G;                         // W e^-1 W^T
    Matrix3 frame_inverse;            // of the frame's mass matrix, p eliminated
    std::vector<Matrix3> B;           // acceleration of each marker per (a, alpha), p eliminated; body axes
    Vector u, Wu;                     // e^-1 r and W times it
    Vector3 frame;                    // (a, alpha) without constraint forces
    std::vector<Vector3> motion;      // of the markers, global
    Eigen::Matrix<Scalar, 3, Eigen::Dynamic> wrench; // global
    Vector z;                                        // multipliers of the rows of W in x_p
  };

  static void reduce(const PlanarBody &body, Body &b);
  void factorise_body(const PlanarBody &body, const PlanarBodyState &state, Body &b);
  Matrix3 mobility(const Body &b, Eigen::Index k, Eigen::Index l) const; // global
  void free_response(const Scalar *r, Body &b);
  Scalar along_row(std::size_t i) const; // row i of C_q times the motions of the markers

  const System &system_;
  std::vector<Body> bodies_;
  std::vector<MeasureMotion> rows_;
  Scalar damping_factor_ = NAN, stiffness_factor_ = NAN; // of the e at hand
  EnvelopeMatrix<Scalar> schur_;
  Vector nu_;
};

} // namespace ffrobot
