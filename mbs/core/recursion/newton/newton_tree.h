// N = M + E of a tree at rest, E a diagonal, by the articulated recursion (backward_pass.h) with e = 1 + E in the place
// of the identity that stands there for M_ff:
//     p_ddot = e^-1 (r_p - m^T A + sum of P^T f)
//     A_port = X A + beta + G f,   X = X_rigid - P e^-1 m^T,   G = P e^-1 P^T
// What is not eliminated is known without differences, less what e^-1 has not taken: with a = M_rr - m m^T,
//     M_rr - m e^-1 m^T = a + m (1 - e^-1) m^T,   1 - e^-1 = e^-1 E     (X alike)
// Children answer f = -Lambda A_port - pi, that is f = -Y (X A + beta) - (1 + Lambda G)^-1 pi,
// Y = (1 + Lambda G)^-1 Lambda. Numbers may be complex; matrices are symmetric then, not Hermitian.
#pragma once

#include "core/linear/lu.h"
#include "core/linear/square.h"
#include "core/recursion/newton/newton_posture.h"

namespace ffrobot::recursion {

template <class Space, class Scalar> class NewtonTree {
public:
  using Vector = Eigen::Matrix<Scalar, Eigen::Dynamic, 1>;

  // E (n_v), zero along pins whose section modes turn. The posture must outlive this.
  void factorise(const NewtonPosture<Space> &posture, const Vector &E);

  // x (n_v): forces in, N^-1 of them out
  void solve(Scalar *x);

private:
  static constexpr int d = Space::dim;
  using Block = Square<Scalar, d>;
  using Real = Square<double, d>;
  using Part = Column<Scalar, d>;

  // The outboard subtree of a port
  struct Port {
    Block Y, passed; // (1 + Lambda G)^-1 Lambda, (1 + Lambda G)^-1
  };
  struct Node {
    int parts = 1;               // 1 + linked ports
    std::vector<Scalar> inverse; // (n) e^-1
    Lu<Scalar> e;                // m_ff + E, where modes are not orthonormal
    std::vector<Block> blocks;   // (parts, parts) by rows: in the first column M, then X of ports; behind it G
    std::vector<Port> ports;     // with a child
    Block M_inverse, N;          // of an inboard port: N = (X M^-1 X^T + G)^-1
    Real J, tilt, to_section;    // of the body, J with
    Block U, D_inverse;          // columns of freedoms, as U = I J
    Block Lambda;                // in axes of the inboard port
    // of a solve
    std::vector<Scalar> u;            // (n) e^-1 r
    std::vector<Part> motion, forces; // of parts: rows times u; -A and forces on ports
    Part along;                       // D^-1 (r - J^T H)
    Part pi;                          // in axes of the inboard port

    Block &block(int r, int c) { return blocks[static_cast<std::size_t>(parts * r + c)]; }
  };

  void eliminate_modes(const NewtonBody<Space> &body, const Scalar *E, Node &node);
  void eliminate_bent_modes(const NewtonBody<Space> &body, const Scalar *E, Node &node);
  void eliminate_ports(const NewtonBody<Space> &body, Node &node);
  void eliminate_joint(const recursion::Node<Space> &joint, const NewtonBody<Space> &body, const Scalar *E, Node &node);
  void inward(const recursion::Node<Space> &joint, const NewtonBody<Space> &body, Scalar *x, Node &node);
  void outward(const recursion::Node<Space> &joint, const NewtonBody<Space> &body, Scalar *x, Node &node);

  const NewtonPosture<Space> *posture_ = nullptr;
  std::vector<Node> nodes_;
  std::vector<Part> A_port_;       // of all ports
  std::vector<Scalar> x_of_modes_; // of one body
};

extern template class NewtonTree<Planar, double>;
extern template class NewtonTree<Planar, std::complex<double>>;
extern template class NewtonTree<Spatial, double>;
extern template class NewtonTree<Spatial, std::complex<double>>;

} // namespace ffrobot::recursion
