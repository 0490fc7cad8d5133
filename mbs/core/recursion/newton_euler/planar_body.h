// What a known motion takes of one body in the plane; of its modes: known_body.h.
#pragma once

#include "core/recursion/kinematics/planar.h"

namespace ffrobot::recursion::planar {

using Vector = std::array<double, 3>; // (x, y, about z): an acceleration less gravity, or a force with its moment

// Nothing is kept of a body but what its state has.
struct KnownBody {
  explicit KnownBody(const Body &) {}
  void take(const Body &b, const double *p, const double *v, State<double> &s) { forces_on_rows(b, p, v, s); }
};

inline std::array<double, 2> place(const Port &port, const State<double> &s) {
  const std::size_t row = port.row;
  return {port.x + s.u[row], port.y + s.u[row + 1]};
}

// Of a port against the frame: what its acceleration has beside the frame's linear one. alpha: of the frame
inline Vector relative_acceleration(const Port &port, const State<double> &s, double alpha, const VectorXd &u_ddot) {
  const auto [x, y] = place(port, s);
  const double *u_dot = s.u_dot.data() + port.row, *elastic = u_ddot.data() + port.row;
  const double ww = s.omega * s.omega, w2 = 2 * s.omega;
  return {-alpha * y - ww * x - w2 * u_dot[1] + elastic[0], alpha * x - ww * y + w2 * u_dot[0] + elastic[1],
          elastic[2]};
}

// Of port i by that of the frame, and back, in axes of the body and of the undeformed port
inline Vector port_acceleration(const Body &b, int i, const State<double> &s, const Vector &A, const VectorXd &u_ddot) {
  Vector found = relative_acceleration(b.ports[i], s, A[2], u_ddot);
  for (std::size_t k = 0; k < 3; ++k)
    found[k] += A[k];
  return found;
}
inline Vector frame_acceleration(const Body &b, int i, const State<double> &s, const Vector &at_port,
                                 const VectorXd &u_ddot) {
  const Port &port = b.ports[i];
  const double alpha = at_port[2] - u_ddot[port.row + 2];
  const Vector relative = relative_acceleration(port, s, alpha, u_ddot);
  return {at_port[0] - relative[0], at_port[1] - relative[1], alpha};
}
// Of a frame that sits where modes turn the section (Body::TILT)
inline void tilt_back(const Body &b, const VectorXd &u_ddot, Vector &A) {
  if (b.is_tilted)
    A[2] -= u_ddot[Body::TILT];
}

// M_rr A + m p_ddot - Q_r: force and moment about the origin of the frame. u_ddot: W p_ddot
inline Vector inertia_force(const Body &b, const KnownBody &, const State<double> &s, const Vector &A,
                            const double *p_ddot, const VectorXd &u_ddot) {
  const double ww = s.omega * s.omega, w2 = 2 * s.omega;
  const double sx = b.sx + s.u[Body::Sx], sy = b.sy + s.u[Body::Sy];
  double h_p_ddot = u_ddot[Body::H];
  for (int k = 0; b.has_more && k < b.n; ++k)
    h_p_ddot += s.h[k] * p_ddot[k];
  return {b.mass * A[0] - A[2] * sy - ww * sx - w2 * s.u_dot[Body::Sy] + u_ddot[Body::Sx],
          b.mass * A[1] + A[2] * sx - ww * sy + w2 * s.u_dot[Body::Sx] + u_ddot[Body::Sy],
          sx * A[1] - sy * A[0] + (b.J + s.p_p) * A[2] + w2 * s.p_v + h_p_ddot};
}

// A force on port i with its moment about the port, in the port's axes, as one at the frame, and back
inline void to_frame(const Body &b, int i, const State<double> &s, Vector &f) {
  const auto from = place(b.ports[i], s);
  PlanarTurn<double>::add_moment(from.data(), f.data());
}
inline void to_port(const Body &b, int i, const State<double> &s, Vector &f) {
  const auto [x, y] = place(b.ports[i], s);
  const double back[2] = {-x, -y};
  PlanarTurn<double>::add_moment(back, f.data());
}

// act(row of W, force) of a force on port i; of a moment on a frame that modes turn
template <class Act> void put_on_rows(const Body &b, int i, const State<double> &, const Vector &f, const Act &act) {
  for (Index k = 0; k < 3; ++k)
    act(b.ports[i].row + k, f[k]);
}
template <class Act> void on_tilt(const Body &b, const Vector &f, const Act &act) {
  if (b.is_tilted)
    act(Body::TILT, f[2]);
}

inline void body_to_global(const State<double> &s, const double *x, double *y) {
  PlanarTurn<double>{s.absolute_cosine, s.absolute_sine}.apply(x, y);
}

inline double modal_terms(const Body &b, int i, const State<double> &s) { // sizes of W Q_f of port i
  const double *modal = s.Q.data() + b.ports[i].row;
  return std::abs(modal[0]) + std::abs(modal[1]) + std::abs(modal[2]);
}

} // namespace ffrobot::recursion::planar
