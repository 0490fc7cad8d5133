// One evaluation of accelerations and multipliers in the plane, without the integrator: `evaluation MECHANISM COUNT`
// prints its microseconds and a sum that tells whether two programs compute the same. Links have ten modes.
//
//     two      two links, the first supported at both ends, the tip of the second led along a path (two rows)
//     chain N  N cantilevers, the tip led;  open N: without rows
//     crank    a driven rigid crank, a rod of six modes and a slider, whose pin closes the loop (three rows)
//     four     a driven rigid crank, a coupler and a rocker of six modes (three rows)
//
//     valgrind --tool=callgrind ./evaluation two 3000     # less that of 1000, by 2000
#include "core/recursion/constrained_aba/workspace.h"
#include "links.h"

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>

using namespace ffrobot;
using namespace ffrobot::recursion;
using Eigen::VectorXd;

namespace {

struct Model {
  std::vector<BodyModel<PlanarData>> bodies;
  std::vector<ConstraintModel> rows;
  std::vector<PlanarMarker> ground{PlanarMarker()};

  void hang(PlanarData data, int parent, JointKind joint = JointKind::revolute) {
    bodies.emplace_back();
    bodies.back().parent = parent, bodies.back().parent_marker = parent < 0 ? 0 : 1;
    bodies.back().joint = joint, bodies.back().data = std::move(data);
  }
  void tie(int tip_of, MarkerAt to) { // its tip to a marker
    for (int k = 0; k < 2; ++k)
      rows.push_back({"tip", ConstraintKind::point, to, {tip_of, 1}, Eigen::Vector3d::Unit(k)});
  }
  void drive_first() {
    bodies[0].driven = true;
    rows.push_back({"drive", ConstraintKind::coordinate});
    rows.back().coordinate = 0;
  }
};

PlanarData rigid(double length) {
  PlanarData data = link(true, 0);
  data.mass *= length, data.first_moment *= length * length, data.inertia *= length * length * length;
  data.markers[1].position *= length;
  return data;
}

Model model(const std::string &kind, int count) {
  Model m;
  if (kind == "two") {
    m.hang(link(false), -1), m.hang(link(true), 0), m.tie(1, {-1, 0});
    m.bodies[0].of_section = true;
  } else if (kind == "crank") {
    m.hang(rigid(0.3), -1), m.hang(link(false, 6), 0), m.hang(rigid(0.2), -1, JointKind::prismatic);
    m.drive_first(), m.tie(1, {2, 0});
  } else if (kind == "four") {
    m.hang(rigid(0.3), -1), m.hang(link(false, 6), 0), m.hang(link(false, 6), 1);
    m.ground.emplace_back(), m.ground[1].position = {1, 0.2};
    m.drive_first(), m.tie(2, {-1, 1});
  } else {
    for (int i = 0; i < count; ++i)
      m.hang(link(true), i - 1);
    if (kind == "chain")
      m.tie(count - 1, {-1, 0});
  }
  return m;
}

} // namespace

int main(int number, char **given) {
  const std::string kind = given[1];
  const bool is_chain = kind == "chain" || kind == "open";
  Model parts = model(kind, is_chain ? std::atoi(given[2]) : 0);
  const int count = std::atoi(given[number - 1]);
  const Mechanism<Planar> m(parts.bodies, parts.ground, parts.rows, {}, Eigen::Vector2d(0, -9.81));
  Workspace<Planar, double> w(m);
  VectorXd q = VectorXd::Zero(m.n_q), v = VectorXd::Zero(m.n_v), a = v;
  double turn = 0.3;
  for (const auto &node : m.nodes) {
    q[node.q] = turn, v[node.v] = turn > 1 ? 0.6 : -0.3, turn += 0.7;
    for (int i = 0; i < node.n(); ++i)
      q[node.p_q() + i] = 1e-4 / (1 + i), v[node.p_v() + i] = 2e-3 / (1 + i);
  }
  const double target[3] = {-0.9, -0.5, 0.2};
  const auto start = std::chrono::steady_clock::now();
  for (int i = 0; i < count; ++i)
    accelerations(m, q.data(), v.data(), Forces<double>(), target, w, a.data());
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  std::printf("%.4f %.12g\n", 1e6 * seconds / count, a.cwiseAbs().sum());
}
