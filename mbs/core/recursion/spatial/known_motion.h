// What a known motion takes of one body in space, for the recursive Newton-Euler algorithm (newton_euler.h). With modes
// x = L^T p_ddot, m_ff = L L^T (L = 1 without geometric stiffening), the elimination leaves of the body's equations
//
//     M_rr A + m p_ddot - Q_r = M A + bias + m L^-T d,   d = x - L^-1 (Q_f - m^T A),   modal forces: L d
//
// with M = M_rr - m m_ff^-1 m^T and bias = -(Q_r - m m_ff^-1 Q_f).
#pragma once

#include "core/recursion/spatial/kinematics.h"

#include <Eigen/Core>

#include <array>

namespace ffrobot::recursion::spatial {

using Vector =
    std::array<double, 6>; // (along, about) x, y, z: an acceleration less gravity, or a force with its moment
using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using Rows = Eigen::Map<const RowMajor, 0, Eigen::OuterStride<>>;

// W L^-T (width, n)
inline Rows rows_of(const Body &b, const State<double> &s) {
  const double *rows = b.stiffening ? s.bent.rows.data() : b.rows.data();
  return {rows, b.width, b.n, Eigen::OuterStride<>(padded(b.n))};
}
inline Eigen::VectorXd vector_of(const Aligned<double> &x, int n) {
  return Eigen::Map<const Eigen::VectorXd>(x.data(), n);
}

// M, bias and rows m L^-T of the frame, at the state that take() saw
struct KnownBody {
  explicit KnownBody(const Body &b) : m(6, b.n) {}
  void take(const Body &b, const double *, const double *, State<double> &s) { // once at a state
    Pack<double, 6> packed_M[6];
    FrameTerms<double> found(packed_M, bias.data());
    inertia(b, s, found);
    for (int i = 0; i < 6; ++i)
      for (int j = 0; j < 6; ++j)
        M(i, j) = packed_M[i][j];
    if (b.n == 0)
      return;
    m = rows_of(b, s).topRows(6);
    if (b.stiffening)
      return;
    for (std::size_t c = 0; c < b.twists.size(); ++c)
      for (int i = 0; i < 3; ++i)
        m.row(3 + i) += b.twists[c].axis[3 + i] * vector_of(s.h_change[c], b.n).transpose();
  }
  Eigen::Matrix<double, 6, 6> M;
  Eigen::Matrix<double, 6, 1> bias;
  Eigen::MatrixXd m; // (6, n)
};

// L^T x, L x
inline Eigen::VectorXd by_factor(const Body &b, const State<double> &s, const Eigen::VectorXd &x, bool transposed) {
  if (!b.stiffening)
    return x;
  const Rows L(s.bent.factor.data(), b.n, b.n, Eigen::OuterStride<>(padded(b.n)));
  if (transposed)
    return L.triangularView<Eigen::Lower>().transpose() * x;
  return L.triangularView<Eigen::Lower>() * x;
}

// Of rows of W: W p_ddot, with geometric stiffening less p_dot^T K p_dot
inline Eigen::VectorXd elastic_accelerations(const Body &b, const KnownBody &, const State<double> &s,
                                             const double *p_ddot) {
  if (b.n == 0)
    return Eigen::VectorXd::Zero(b.width);
  Eigen::VectorXd found = rows_of(b, s) * by_factor(b, s, Eigen::Map<const Eigen::VectorXd>(p_ddot, b.n), true);
  if (b.stiffening)
    found -= Eigen::Map<const Eigen::VectorXd>(s.bent.curvature.data(), found.size());
  return found;
}

// What a port's acceleration has beside R^T (a + alpha x r; alpha): in axes of the undeformed port
inline Vector relative_acceleration(const Body &b, int i, const State<double> &s, const Eigen::VectorXd &u_ddot) {
  const Port &port = b.ports[static_cast<std::size_t>(i)];
  const PortMotion<double> &motion = s.ports[static_cast<std::size_t>(i)];
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
inline Vector port_acceleration(const Body &b, int i, const State<double> &s, const Vector &A,
                                const Eigen::VectorXd &u_ddot) {
  Vector found = relative_acceleration(b, i, s, u_ddot), moved = A;
  double along[3], about[3];
  SpatialTurn<double>::shift(s.ports[static_cast<std::size_t>(i)].r, moved.data());
  const Port &port = b.ports[static_cast<std::size_t>(i)];
  turn_back(port.R, moved.data(), along), turn_back(port.R, moved.data() + 3, about);
  for (std::size_t k = 0; k < 3; ++k)
    found[k] += along[k], found[3 + k] += about[k];
  return found;
}
inline Vector frame_acceleration(const Body &b, int i, const State<double> &s, const Vector &at_port,
                                 const Eigen::VectorXd &u_ddot) {
  const Vector relative = relative_acceleration(b, i, s, u_ddot);
  const Port &port = b.ports[static_cast<std::size_t>(i)];
  double rest[6];
  for (std::size_t k = 0; k < 6; ++k)
    rest[k] = at_port[k] - relative[k];
  Vector found;
  turn(port.R, rest, found.data()), turn(port.R, rest + 3, found.data() + 3);
  const double *r = s.ports[static_cast<std::size_t>(i)].r, back[3] = {-r[0], -r[1], -r[2]};
  SpatialTurn<double>::shift(back, found.data());
  return found;
}
inline void tilt_back(const Body &, const Eigen::VectorXd &, Vector &) {}

// L^-1 (Q_f - m^T A + sum of P^T f) (n). z: by rows of W, -A and forces on ports
inline Eigen::VectorXd accelerations_by(const Body &b, const KnownBody &known, const State<double> &s,
                                        const Eigen::Ref<const Eigen::VectorXd> &z) {
  Eigen::VectorXd found = vector_of(s.Q_f, b.n) + known.m.transpose() * z.head(6);
  const Rows W = rows_of(b, s);
  for (const Port &port : b.ports)
    if (port.is_flexible)
      found += W.middleRows(port.row, 6).transpose() * z.segment(port.row, 6);
  return found;
}

// M_rr A + m p_ddot - Q_r: force and moment about the origin of the frame
inline Vector inertia_force(const Body &b, const KnownBody &known, const State<double> &s, const Vector &A,
                            const double *p_ddot, const Eigen::VectorXd &) {
  const Eigen::Map<const Eigen::Matrix<double, 6, 1>> frame(A.data());
  Eigen::Matrix<double, 6, 1> f = known.M * frame + known.bias;
  if (b.n) {
    const Eigen::VectorXd x = by_factor(b, s, Eigen::Map<const Eigen::VectorXd>(p_ddot, b.n), true);
    f += known.m * (x - vector_of(s.Q_f, b.n) + known.m.transpose() * frame);
  }
  return {f[0], f[1], f[2], f[3], f[4], f[5]};
}

// A force on port i with its moment about the port, in the port's axes, as one at the frame, and back
inline void to_frame(const Body &b, int i, const State<double> &s, Vector &f) {
  const Port &port = b.ports[static_cast<std::size_t>(i)];
  const Vector at_port = f;
  turn(port.R, at_port.data(), f.data()), turn(port.R, at_port.data() + 3, f.data() + 3);
  SpatialTurn<double>::add_moment(s.ports[static_cast<std::size_t>(i)].r, f.data());
}
inline void to_port(const Body &b, int i, const State<double> &s, Vector &f) {
  const Port &port = b.ports[static_cast<std::size_t>(i)];
  const double *r = s.ports[static_cast<std::size_t>(i)].r, back[3] = {-r[0], -r[1], -r[2]};
  SpatialTurn<double>::add_moment(back, f.data());
  const Vector at_frame = f;
  turn_back(port.R, at_frame.data(), f.data()), turn_back(port.R, at_frame.data() + 3, f.data() + 3);
}

// act(row of W, force) of a force on port i: Phi^T (f, J_l^T moment)
template <class Act> void put_on_rows(const Body &b, int i, const State<double> &s, const Vector &f, const Act &act) {
  const Port &port = b.ports[static_cast<std::size_t>(i)];
  if (!port.is_flexible)
    return;
  double moment[3];
  turn_back(s.ports[static_cast<std::size_t>(i)].excess, f.data() + 3, moment);
  for (std::size_t k = 0; k < 3; ++k) {
    act(port.row + static_cast<int>(k), f[k]);
    act(port.row + 3 + static_cast<int>(k), f[3 + k] + moment[k]);
  }
}
template <class Act> void on_tilt(const Body &, const Vector &, const Act &) {}

// Generalized forces on the modes: each(act) calls act(row of W, force).
template <class Each>
void put_on_modes(const Body &b, const KnownBody &, const State<double> &s, const Each &each, double *modal) {
  const Rows W = rows_of(b, s);
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(b.n);
  each([&](Eigen::Index row, double force) { sum += force * W.row(row).transpose(); });
  Eigen::Map<Eigen::VectorXd>(modal, b.n) = by_factor(b, s, sum, false);
}

// m_ff p_ddot + m^T A - Q_f - sum of P^T f (n). z: by rows of W, -A and forces on ports
inline void modal_residual(const Body &b, const KnownBody &known, const double *, const double *p_ddot, double *z,
                           State<double> &s, double *to) {
  const Eigen::VectorXd x = by_factor(b, s, Eigen::Map<const Eigen::VectorXd>(p_ddot, b.n), true);
  const Eigen::VectorXd by_forces = accelerations_by(b, known, s, Eigen::Map<const Eigen::VectorXd>(z, b.width));
  Eigen::Map<Eigen::VectorXd>(to, b.n) = by_factor(b, s, x - by_forces, false);
}

inline void body_to_global(const State<double> &s, const double *x, double *y) {
  turn(s.absolute, x, y), turn(s.absolute, x + 3, y + 3);
}

inline double modal_terms(const Body &b, int i, const State<double> &s) { // sizes of W Q_f of port i
  const Port &port = b.ports[static_cast<std::size_t>(i)];
  if (!port.is_flexible)
    return 0;
  double sum = 0;
  for (int k = 0; k < 6; ++k)
    sum += std::abs(s.Q[static_cast<std::size_t>(port.row + k)]);
  return sum;
}

} // namespace ffrobot::recursion::spatial
