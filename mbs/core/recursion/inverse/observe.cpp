#include "core/recursion/inverse/observe.h"

#include "core/recursion/constrained_aba/once.h"

#include <Eigen/Geometry>

namespace ffrobot::recursion {

namespace {

Vector3d vector(const double *x) { return {x[0], x[1], x[2]}; }

Matrix3d axes(const Pose<double> &frame) {
  Matrix3d R;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      R(i, j) = frame.R[i][j];
  return R;
}

// A in body axes as linear and angular parts with three components each
std::pair<Vector3d, Vector3d> parts(const planar::State<double> &s) { return {{s.A[0], s.A[1], 0}, {0, 0, s.A[2]}}; }
std::pair<Vector3d, Vector3d> parts(const spatial::State<double> &s) { return {vector(s.A), vector(s.A + 3)}; }

// Of one body: s and M_rr of the frame (translation, rotation; body axes), m p_dot (linear, angular), 1/2 p_dot^T m_ff
// p_dot
struct Inertia {
  double mass, modal;
  Vector3d s = Vector3d::Zero(), S_p_dot = s, h_p_dot = s;
  Matrix3d J = Matrix3d::Zero();
};

double half_square(int n, const double *v) { return 0.5 * Map<const VectorXd>(v, n).squaredNorm(); }

Inertia inertia_of(const planar::Body &b, const double *p, const double *v, planar::State<double> &s) {
  Inertia to{b.mass, half_square(b.n, v)};
  forces_on_rows(b, p, v, s);
  to.s << b.sx, b.sy, 0;
  to.J(2, 2) = b.J;
  if (b.n) {
    to.s += Vector3d(s.u[0], s.u[1], 0), to.S_p_dot << s.u_dot[0], s.u_dot[1], 0;
    to.h_p_dot[2] = s.u_dot[2], to.J(2, 2) += s.p_p;
    for (int i = 0; b.has_more && i < b.n; ++i)
      to.h_p_dot[2] += s.h[i] * v[i];
    if (b.stiffening)
      to.modal += planar::bending_energy(s);
  }
  return to;
}

Inertia inertia_of(const spatial::Body &b, const double *, const double *v, spatial::State<double> &s) {
  Inertia to{b.mass, half_square(b.n, v)};
  Pack<double, 6> M[6];
  double bias[6];
  spatial::FrameTerms<double> frame(M, bias);
  inertia(b, s, frame);
  to.s = vector(s.s);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      to.J(i, j) = frame.J[symmetric_index(i, j)];
  if (b.n) {
    to.S_p_dot = vector(s.u_dot.data()), to.h_p_dot = vector(s.h_rate);
    if (b.stiffening)
      to.modal += spatial::bending_energy(b, s);
  }
  return to;
}

// Axes of the section that the joint holds
template <class Space> Matrix3d outer_axes(std::size_t i, const Workspace<Space, double> &w) {
  const Node<Space> &node = w.m.nodes[i];
  if (node.inboard < 0)
    return axes(w.frames[i]);
  Pose<double> section;
  section_pose(node.body, node.inboard, w.bodies[i], w.frames[i], section);
  return axes(section);
}

void write_motion(const Pose<double> &of, double *to) {
  const Matrix3d R = axes(of);
  Map<Matrix<double, 18, 1>> found(to);
  found << vector(of.r), R.row(0).transpose(), R.row(1).transpose(), R.row(2).transpose(), vector(of.v),
      vector(of.omega);
}

} // namespace

template <class Space> std::vector<FrameMotion> frame_motions(const Workspace<Space, double> &w) {
  Vector3d g = Vector3d::Zero();
  g.head(w.m.gravity.size()) = w.m.gravity;
  std::vector<FrameMotion> all;
  for (std::size_t i = 0; i < w.m.nodes.size(); ++i) {
    const Pose<double> &frame = w.frames[i];
    const auto [a, alpha] = parts(w.bodies[i]);
    const Matrix3d R = axes(frame);
    const Vector3d acceleration = R * a + g, turning = R * alpha, omega = vector(frame.omega);
    const Vector3d d = R * w.m.nodes[i].origin;
    const Vector3d at_origin = acceleration + turning.cross(d) + omega.cross(omega.cross(d));
    all.push_back({vector(frame.r), acceleration, omega, turning, R, at_origin});
  }
  return all;
}

namespace {

struct Totals {
  double kinetic = 0, strain = 0, gravitational = 0, dissipated = 0;
  Vector3d momentum = Vector3d::Zero(), angular_momentum = Vector3d::Zero();
};

template <class Space> Totals totals(const Placed<Space, double> &at) {
  const auto &[w, q, v, generalized] = at;
  const auto &m = w.m;
  Totals sum;
  Vector3d g = Vector3d::Zero();
  g.head(m.gravity.size()) = m.gravity;
  for (std::size_t i = 0; i < m.nodes.size(); ++i) {
    const Node<Space> &node = m.nodes[i];
    const double *p = q + node.p_q(), *p_dot = v + node.p_v();
    const Inertia body = inertia_of(node.body, p, p_dot, w.bodies[i]);
    const Matrix3d R = axes(w.frames[i]);
    const Vector3d r = vector(w.frames[i].r), u = R.transpose() * vector(w.frames[i].v),
                   omega = R.transpose() * vector(w.frames[i].omega);
    const Vector3d linear = body.mass * u + omega.cross(body.s) + body.S_p_dot;
    const Vector3d angular = body.s.cross(u) + body.J * omega + body.h_p_dot;
    sum.kinetic +=
        0.5 * (u.dot(linear) + omega.dot(angular) + u.dot(body.S_p_dot) + omega.dot(body.h_p_dot)) + body.modal;
    for (int k = 0; k < node.n(); ++k)
      sum.strain += 0.5 * node.body.K[k] * p[k] * p[k];
    const Map<const VectorXd> rates(p_dot, node.n());
    const auto &D = node.body.D_full;
    sum.dissipated +=
        D.size() ? rates.dot(D * rates) : rates.cwiseAbs2().dot(Map<const VectorXd>(node.body.D.data(), node.n()));
    sum.gravitational -= g.dot(body.mass * r + R * body.s);
    sum.momentum += R * linear;
    sum.angular_momentum += R * angular + r.cross(R * linear);
    if (node.rotor_inertia > 0) {
      const double spin = w.hinges[i].spin;
      sum.kinetic += 0.5 * node.rotor_inertia * spin * spin;
      sum.angular_momentum += node.rotor_turns * node.rotor_inertia * spin * outer_axes(i, w).col(2);
    }
  }
  return sum;
}

template <class Space>
Totals totals(const Scene &scene, const double *q, const double *v, Workspace<Space, double> &w) {
  const Placed<Space, double> placed = place_all(q, v, nullptr, w);
  Totals sum = totals(placed);
  for (const JointForce &joint : scene.joint_forces) {
    const double way = q[joint.q] - joint.rest, rate = v[joint.v];
    sum.strain += 0.5 * joint.stiffness * way * way;
    sum.dissipated += joint.friction.resistance(rate) * rate;
  }
  for (const auto &[a, b, ratio, spring, damping] : scene.gears) {
    const double twist = q[a.q] - ratio * q[b.q], rate = v[a.v] - ratio * v[b.v];
    sum.strain += spring.energy(twist);
    sum.dissipated += damping * rate * rate;
  }
  std::vector<double> rates(scene.cut_joints.size());
  cut_rates(placed, scene.cut_joints, rates.data());
  for (std::size_t k = 0; k < rates.size(); ++k)
    sum.dissipated += scene.cut_joints[k].friction.resistance(rates[k]) * rates[k];
  return sum;
}

} // namespace

template <class Space> RowMajor motions_of_states(const RowMajor &q, const RowMajor &v, Workspace<Space, double> &w) {
  RowMajor found(q.rows(), 18 * static_cast<Index>(w.m.nodes.size() + w.m.wrenches.size()));
  for (Index i = 0; i < q.rows(); ++i) {
    const Placed<Space, double> at = place_all(q.row(i).data(), v.row(i).data(), nullptr, w);
    double *to = found.row(i).data();
    for (const Pose<double> &frame : w.frames)
      write_motion(frame, to), to += 18;
    for (std::size_t k = 0; k < w.m.wrenches.size(); ++k, to += 18)
      write_motion(wrench_pose(at, static_cast<int>(k)), to);
  }
  return found;
}

template <class Space> RowMajor without_work(const Rows &q, const Rows &forces, Workspace<Space, double> &w) {
  constexpr int d = Space::dim, linear = Space::linear;
  const std::vector<double> still(w.m.n_v);
  RowMajor found(forces.rows(), forces.cols());
  for (Index i = 0; i < q.rows(); ++i) {
    place_all(q.row(i).data(), still.data(), nullptr, w);
    for (std::size_t k = 0; k < w.m.nodes.size(); ++k) {
      const Node<Space> &node = w.m.nodes[k];
      Matrix<double, d, d> axes = Matrix<double, d, d>::Identity();
      const Matrix3d R = outer_axes(k, w);
      axes.template topLeftCorner<linear, linear>() = R.topLeftCorner<linear, linear>();
      if constexpr (d == 6)
        axes.template bottomRightCorner<3, 3>() = R;
      const Index place = k * d;
      Matrix<double, d, 1> f = axes.transpose() * forces.row(i).segment<d>(place).transpose();
      forces_by_freedoms<1>(node, w.hinges[k], f.data());
      for (int c = 0; c < node.shape.freedoms.count; ++c)
        f[node.shape.freedoms.component[c]] = 0;
      forces_by_freedoms<-1>(node, w.hinges[k], f.data());
      found.row(i).segment<d>(place) = axes * f;
    }
  }
  return found;
}

template <class Space>
RowMajor totals_of_states(const Mechanism<Space> &m, const Scene &scene, const RowMajor &q, const RowMajor &v) {
  Workspace<Space, double> w(m);
  RowMajor found(q.rows(), 10);
  for (Index i = 0; i < q.rows(); ++i) {
    const Totals sum = totals(scene, q.row(i).data(), v.row(i).data(), w);
    found.row(i) << sum.kinetic, sum.strain, sum.gravitational, sum.dissipated, sum.momentum.transpose(),
        sum.angular_momentum.transpose();
  }
  return found;
}

#define FFROBOT_INSTANTIATE(Space)                                                                                     \
  template std::vector<FrameMotion> frame_motions(const Workspace<Space, double> &);                                   \
  template RowMajor motions_of_states(const RowMajor &, const RowMajor &, Workspace<Space, double> &);                 \
  template RowMajor without_work(const Rows &, const Rows &, Workspace<Space, double> &);                              \
  template RowMajor totals_of_states(const Mechanism<Space> &, const Scene &, const RowMajor &, const RowMajor &);
FFROBOT_INSTANTIATE(Planar)
FFROBOT_INSTANTIATE(Spatial)
#undef FFROBOT_INSTANTIATE

} // namespace ffrobot::recursion
