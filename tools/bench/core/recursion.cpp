// One evaluation of the recursion in space, of chains of revolute joints: 3 or 6 links with 10 modes and rows at the
// tip, or 6 rigid ones. `CHAIN ROWS REPETITIONS` prints the microseconds of the fastest of 20 rounds,
// with `d` behind them those of an evaluation in duals, with derivatives in eight directions.
#include "core/recursion/mechanism/workspace.h"
#include "core/recursion/numbers/dual.h"

#include <Eigen/Geometry>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <random>

using namespace ffrobot::recursion;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

constexpr int points = 40; // of a link along x

std::mt19937 engine(1);
double number() { return std::uniform_real_distribution<double>(-1, 1)(engine); }
Matrix3d turn() { return Eigen::AngleAxisd(number(), Vector3d(number(), number(), number()).normalized()).matrix(); }

// A link that bends in two planes and twists, as points along its axis: modes (bending, bending, twist) in turn.
struct Shape {
  int family, number;
  double at(double x) const { return x * x * std::cos(number * 3.0 * x); }
  double slope(double x) const {
    return 2 * x * std::cos(number * 3.0 * x) - 3.0 * number * x * x * std::sin(number * 3.0 * x);
  }
};

MatrixXd section(const std::vector<Shape> &shapes, double x) {
  MatrixXd Phi = MatrixXd::Zero(6, static_cast<Eigen::Index>(shapes.size()));
  for (std::size_t k = 0; k < shapes.size(); ++k) {
    const auto j = static_cast<Eigen::Index>(k);
    const Shape &shape = shapes[k];
    if (shape.family == 0)
      Phi(1, j) = shape.at(x), Phi(5, j) = shape.slope(x);
    else if (shape.family == 1)
      Phi(2, j) = shape.at(x), Phi(4, j) = -shape.slope(x);
    else
      Phi(3, j) = shape.at(x);
  }
  return Phi;
}

SpatialData link(int modes) {
  SpatialData data;
  const double m = 2.0 / points, I_p = 0.01;
  std::vector<Shape> shapes;
  for (int k = 0; k < modes; ++k)
    shapes.push_back({k % 5 == 4 ? 2 : k % 2, 1 + k / 2});
  MatrixXd mass = MatrixXd::Zero(modes, modes);
  const auto each = [&](const auto &act) {
    for (int i = 0; i < points; ++i)
      act((i + 0.5) / points);
  };
  each([&](double x) {
    const MatrixXd Phi = section(shapes, x);
    mass += m * Phi.topRows<3>().transpose() * Phi.topRows<3>() + m * I_p * Phi.row(3).transpose() * Phi.row(3);
  });
  const MatrixXd T = modes ? MatrixXd(mass.llt().matrixL().toDenseMatrix().inverse().transpose()) : MatrixXd();
  const auto rows = [&](double x) { return modes ? MatrixXd(section(shapes, x) * T) : MatrixXd(6, 0); };
  data.mass = 2.0;
  data.J_spin = data.mass * I_p;
  if (modes) {
    data.S_bar = MatrixXd::Zero(3, modes), data.I_bar = MatrixXd::Zero(9, modes);
    data.h_spin = VectorXd::Zero(modes), data.S_spin = MatrixXd::Zero(modes, modes);
    for (auto &block : data.S_bar_kl)
      block = MatrixXd::Zero(modes, modes);
    data.stiffness = VectorXd::LinSpaced(modes, 1e3, 1e6), data.damping = VectorXd::Constant(modes, 0.1);
  }
  each([&](double x) {
    const Vector3d r(x, 0, 0);
    data.first_moment += m * r, data.J2 += m * r * r.transpose();
    if (!modes)
      return;
    const MatrixXd Phi = rows(x), S = Phi.topRows<3>();
    data.S_bar += m * S;
    for (int k = 0; k < 3; ++k)
      for (int l = 0; l < 3; ++l) {
        data.I_bar.row(3 * k + l) += m * r[k] * S.row(l);
        data.S_bar_kl[static_cast<std::size_t>(3 * k + l)] += m * S.row(k).transpose() * S.row(l);
      }
    data.h_spin += m * I_p * Phi.row(3).transpose();
    data.S_spin += m * I_p * Phi.row(3).transpose() * Phi.row(3);
  });
  if (modes)
    data.S_bar_kl[8] += data.S_spin; // booked there
  if (!modes)
    data.J2.diagonal() += Vector3d::Constant(0.02);
  SpatialMarker root, tip;
  root.triad = turn();
  tip.position = Vector3d::UnitX(), tip.triad = turn(), root.Phi = rows(0), tip.Phi = rows(1);
  data.markers = {root, tip};
  return data;
}

Eight unit(std::size_t i) {
  double x[8] = {};
  x[i] = 1;
  Eight found;
  std::memcpy(&found, x, sizeof x);
  return found;
}

// Of one evaluation, the fastest of 20 rounds; of duals one of eight directions for each coordinate in turn.
template <class T>
double microseconds(const Mechanism<Spatial> &mechanism, const VectorXd &q, const VectorXd &v, int repetitions) {
  Workspace<Spatial, T> w(mechanism);
  std::vector<T> at(q.begin(), q.end()), rate(v.begin(), v.end()), a(v.size());
  const std::vector<T> target(16, T(0.));
  if constexpr (!std::is_same_v<T, double>)
    for (std::size_t i = 0; i < at.size(); ++i)
      at[i].rate = unit(i % 8);
  double fastest = 1e9;
  for (int round = 0; round < 20; ++round) {
    const auto start = std::chrono::steady_clock::now();
    for (int i = 0; i < repetitions; ++i)
      accelerations(at.data(), rate.data(), Forces<T>(), target.data(), w, a.data());
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    fastest = std::min(fastest, 1e6 * seconds / repetitions);
  }
  return fastest;
}

} // namespace

int main(int count, char **given) {
  const int modes = given[1][1] == 'r' ? 0 : 10, links = given[1][0] - '0', rows = std::atoi(given[2]);
  const int repetitions = std::atoi(given[3]);
  std::vector<BodyModel<SpatialData>> bodies;
  for (int i = 0; i < links; ++i) {
    BodyModel<SpatialData> body;
    body.parent = i - 1, body.parent_marker = i ? 1 : 0, body.data = link(modes);
    bodies.push_back(body);
  }
  std::vector<ConstraintModel> held;
  for (int k = 0; k < rows; ++k) {
    ConstraintModel row;
    row.kind = k < 3 ? ConstraintKind::point : ConstraintKind::rotation, row.f = Vector3d::Unit(k % 3);
    row.a = {-1, 0}, row.b = {links - 1, 1};
    held.push_back(row);
  }
  const Mechanism<Spatial> mechanism(bodies, {SpatialMarker()}, held, {}, Vector3d(0, 0, -9.81));
  VectorXd q(mechanism.n_q), v(mechanism.n_v);
  for (int i = 0; i < mechanism.n_q; ++i)
    q[i] = 0.01 * number(), v[i] = number();
  for (const auto &node : mechanism.nodes)
    q[node.q] = number();
  const bool duals = count > 4 && given[4][0] == 'd';
  std::printf("%.4f\n", duals ? microseconds<Dual>(mechanism, q, v, repetitions)
                              : microseconds<double>(mechanism, q, v, repetitions));
}
