// N = M + E of a tree at rest, E a diagonal, by the articulated recursion (articulated.h) with e = 1 + E in the place
// of the identity that stands there for M_ff:
//     p_ddot = e^-1 (r_p - m^T A + sum of P^T f)
//     A_port = X A + beta + G f,   X = X_rigid - P e^-1 m^T,   G = P e^-1 P^T
// What is not eliminated is known without differences, less what e^-1 has not taken: with a = M_rr - m m^T,
//     M_rr - m e^-1 m^T = a + m (1 - e^-1) m^T,   1 - e^-1 = e^-1 E     (X alike)
// Children answer f = -Lambda A_port - pi, that is f = -Y (X A + beta) - (1 + Lambda G)^-1 pi,
// Y = (1 + Lambda G)^-1 Lambda. Numbers may be complex; matrices are symmetric then, not Hermitian.
#pragma once

#include "core/recursion/newton_posture.h"

#include <Eigen/LU>

namespace ffrobot::recursion {

template <class Space, class Scalar> class NewtonTree {
public:
  using Vector = Eigen::Matrix<Scalar, Eigen::Dynamic, 1>;
  using Matrix = Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>;

  // E (n_v), zero along pins whose section modes turn. The posture must outlive this.
  void factorise(const NewtonPosture<Space> &posture, const Vector &E);

  // x (n_v): forces in, N^-1 of them out
  void solve(Scalar *x);

private:
  static constexpr int d = Space::dim;
  using Square = Eigen::Matrix<Scalar, d, d>;
  using Six = Eigen::Matrix<Scalar, d, 1>;
  using Joint = Eigen::Matrix<Scalar, d, Eigen::Dynamic, Eigen::ColMajor, d, d>;
  using Along = Eigen::Matrix<Scalar, Eigen::Dynamic, 1, Eigen::ColMajor, d, 1>;
  using Freedoms = Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, d, d>;

  // What hangs on a port
  struct Port {
    Square Y, passed; // (1 + Lambda G)^-1 Lambda, (1 + Lambda G)^-1
  };
  struct Node {
    Vector inverse;                // (n) e^-1
    Eigen::PartialPivLU<Matrix> e; // m_ff + E, where modes are not orthonormal
    Matrix blocks;                 // (d (1 + linked))^2: first columns M, then X of ports; behind them G
    std::vector<Port> ports;       // with a child
    Square M_inverse, N;           // of an inboard port: N = (X M^-1 X^T + G)^-1
    Joint U;
    Freedoms D_inverse;
    Square Lambda; // in axes of the port on which it hangs
    // of a solve
    Vector u, motion, forces; // e^-1 r; (d (1 + linked)) rows times u; -A and forces on ports
    Along along;              // D^-1 (r - J^T H)
    Six pi;                   // in axes of the port on which it hangs
  };

  static auto block(Matrix &of, int r, int c) { return of.template block<d, d>(d * r, d * c); }
  static auto part(Vector &of, int r) { return of.template segment<d>(d * r); }

  void eliminate_modes(const NewtonBody<Space> &body, const Scalar *E, Node &node);
  void eliminate_ports(const NewtonBody<Space> &body, Node &node);
  void eliminate_joint(const recursion::Node<Space> &joint, const NewtonBody<Space> &body, const Scalar *E, Node &node);
  void inward(const recursion::Node<Space> &joint, const NewtonBody<Space> &body, Scalar *x, Node &node);
  void outward(const recursion::Node<Space> &joint, const NewtonBody<Space> &body, Scalar *x, Node &node);

  const NewtonPosture<Space> *posture_ = nullptr;
  std::vector<Node> nodes_;
  std::vector<Six> A_port_; // of all ports
};

extern template class NewtonTree<Planar, double>;
extern template class NewtonTree<Planar, std::complex<double>>;
extern template class NewtonTree<Spatial, double>;
extern template class NewtonTree<Spatial, std::complex<double>>;

} // namespace ffrobot::recursion
