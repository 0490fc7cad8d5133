// What a known motion takes of one body in space; of its modes: known_body.h. The elimination leaves of the
// body's equations
//
//     M_rr A + m p_ddot - Q_r = M A + bias + m d,   d = p_ddot - m_ff^-1 (Q_f - m^T A)
//
// with M = M_rr - m m_ff^-1 m^T and bias = -(Q_r - m m_ff^-1 Q_f).
#pragma once

#include "core/recursion/kinematics/spatial.h"

namespace ffrobot::recursion::spatial {

using Vector =
    std::array<double, 6>; // (along, about) x, y, z: an acceleration less gravity, or a force with its moment

// M and bias of the frame, at the state that take() saw
struct KnownBody {
  explicit KnownBody(const Body &) {}
  void take(const Body &b, const double *, const double *, State<double> &s) { // once at a state
    Pack<double, 6> packed_M[6];
    FrameTerms<double> found(packed_M, bias.data());
    inertia(b, s, found);
    for (int i = 0; i < 6; ++i)
      for (int j = 0; j < 6; ++j)
        M(i, j) = packed_M[i][j];
  }
  Matrix<double, 6, 6> M;
  Matrix<double, 6, 1> bias;
};

// What a port's acceleration has beside R^T (a + alpha x r; alpha): in axes of the undeformed port
inline Vector relative_acceleration(const Body &b, int i, const State<double> &s, const VectorXd &u_ddot) {
  const Port &port = b.ports[i];
  const PortMotion<double> &motion = s.ports[i];
  const double *w = s.omega;
  double wr[3], swept[3], du[3], wdu[3], wp[3], turned[3];
  Vector found{};
  cross(w, motion.r, wr), cross(w, wr, swept);
  if (!port.is_flexible) {
    turn_back(port.R, swept, found.data());
    return found;
  }
  turn(port.R, s.u_dot.data() + port.row, du), cross(w, du, wdu);
  for (int k = 0; k < 3; ++k)
    swept[k] += 2 * wdu[k];
  turn_back(port.R, swept, found.data());
  turn_back(port.R, w, wp), cross(wp, motion.rate, found.data() + 3);
  const double *elastic = u_ddot.data() + port.row;
  turn(motion.excess, elastic + 3, turned);
  for (std::size_t k = 0; k < 3; ++k) {
    found[k] += elastic[k];
    found[3 + k] += elastic[3 + k] + turned[k] + motion.drift[k];
  }
  return found;
}

// Of port i by that of the frame, and back, in axes of the body and of the undeformed port
inline Vector port_acceleration(const Body &b, int i, const State<double> &s, const Vector &A, const VectorXd &u_ddot) {
  Vector found = relative_acceleration(b, i, s, u_ddot), moved = A;
  double along[3], about[3];
  SpatialTurn<double>::shift(s.ports[i].r, moved.data());
  const Port &port = b.ports[i];
  turn_back(port.R, moved.data(), along), turn_back(port.R, moved.data() + 3, about);
  for (std::size_t k = 0; k < 3; ++k)
    found[k] += along[k], found[3 + k] += about[k];
  return found;
}
inline Vector frame_acceleration(const Body &b, int i, const State<double> &s, const Vector &at_port,
                                 const VectorXd &u_ddot) {
  const Vector relative = relative_acceleration(b, i, s, u_ddot);
  const Port &port = b.ports[i];
  double rest[6];
  for (std::size_t k = 0; k < 6; ++k)
    rest[k] = at_port[k] - relative[k];
  Vector found;
  turn(port.R, rest, found.data()), turn(port.R, rest + 3, found.data() + 3);
  const double *r = s.ports[i].r, back[3] = {-r[0], -r[1], -r[2]};
  SpatialTurn<double>::shift(back, found.data());
  return found;
}
inline void tilt_back(const Body &, const VectorXd &, Vector &) {}

// M_rr A + m p_ddot - Q_r: force and moment about the origin of the frame
inline Vector inertia_force(const Body &b, const KnownBody &known, const State<double> &s, const Vector &A,
                            const double *p_ddot, const VectorXd &) {
  const Map<const Matrix<double, 6, 1>> frame(A.data());
  Matrix<double, 6, 1> f = known.M * frame + known.bias;
  if (b.n) {
    VectorXd z = VectorXd::Zero(b.width), d(b.n);
    z.head<6>() = -frame;
    modal_accelerations<false>(b, z.data(), s, d.data());
    d = Map<const VectorXd>(p_ddot, b.n) - d;
    f += rows_of(b, s).topRows<6>() * d;
    for (std::size_t c = 0; c < b.twists.size() && !b.stiffening; ++c)
      f.tail<3>() += Map<const VectorXd>(s.h_change[c].data(), b.n).dot(d) * Map<const Vector3d>(b.twists[c].axis + 3);
  }
  return {f[0], f[1], f[2], f[3], f[4], f[5]};
}

// A force on port i with its moment about the port, in the port's axes, as one at the frame, and back
inline void to_frame(const Body &b, int i, const State<double> &s, Vector &f) {
  const Port &port = b.ports[i];
  const Vector at_port = f;
  turn(port.R, at_port.data(), f.data()), turn(port.R, at_port.data() + 3, f.data() + 3);
  SpatialTurn<double>::add_moment(s.ports[i].r, f.data());
}
inline void to_port(const Body &b, int i, const State<double> &s, Vector &f) {
  const Port &port = b.ports[i];
  const double *r = s.ports[i].r, back[3] = {-r[0], -r[1], -r[2]};
  SpatialTurn<double>::add_moment(back, f.data());
  const Vector at_frame = f;
  turn_back(port.R, at_frame.data(), f.data()), turn_back(port.R, at_frame.data() + 3, f.data() + 3);
}

// act(row of W, force) of a force on port i: Phi^T (f, J_l^T moment)
template <class Act> void put_on_rows(const Body &b, int i, const State<double> &s, const Vector &f, const Act &act) {
  const Port &port = b.ports[i];
  if (!port.is_flexible)
    return;
  double moment[3];
  turn_back(s.ports[i].excess, f.data() + 3, moment);
  for (std::size_t k = 0; k < 3; ++k) {
    act(port.row + static_cast<int>(k), f[k]);
    act(port.row + 3 + static_cast<int>(k), f[3 + k] + moment[k]);
  }
}
template <class Act> void on_tilt(const Body &, const Vector &, const Act &) {}

inline void body_to_global(const State<double> &s, const double *x, double *y) {
  turn(s.absolute, x, y), turn(s.absolute, x + 3, y + 3);
}

inline double modal_terms(const Body &b, int i, const State<double> &s) { // sizes of W Q_f of port i
  const Port &port = b.ports[i];
  if (!port.is_flexible)
    return 0;
  double sum = 0;
  for (int k = 0; k < 6; ++k)
    sum += std::abs(s.Q[port.row + k]);
  return sum;
}

} // namespace ffrobot::recursion::spatial
