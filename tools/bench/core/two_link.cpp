// The two-link case on the recursion in the plane, to count its instructions: `e COUNT` evaluates accelerations and
// multipliers that often, without targets, as `r SECONDS` integrates the inverse dynamics from rest at a tolerance of
// 1e-4, with DOP853 and outputs every 10 ms. Prints microseconds of an evaluation, or of a step.
//
//     valgrind --tool=callgrind ./two_link e 3000     # less that of 1000, by 2000
#include "core/integrate/integrate.h"
#include "core/recursion/motion/motion.h"
#include "links.h"

#include <chrono>
#include <cstdio>
#include <cstdlib>

using namespace ffrobot;
using namespace ffrobot::recursion;
using Eigen::VectorXd;

namespace {

constexpr int modes = 10;

// a cos(w t), w = pi/4
TimeFunction component(double a) {
  const Op program[] = {Op::constant, Op::constant, Op::time, Op::multiply,
                        Op::constant, Op::divide,   Op::cos,  Op::multiply};
  const double constants[] = {a, pi, 4};
  return Expression(program, constants);
}

} // namespace

int main(int, char **given) {
  std::vector<BodyModel<PlanarData>> bodies(2);
  for (int i = 0; i < 2; ++i)
    bodies[i].parent = i - 1, bodies[i].parent_marker = i, bodies[i].data = link(i == 1);
  bodies[0].of_section = true;
  std::vector<ConstraintModel> rows(2);
  for (int k = 0; k < 2; ++k)
    rows[k].name = "tip", rows[k].f = Eigen::Vector3d::Unit(k), rows[k].a = {-1, 0}, rows[k].b = {1, 1};
  const Mechanism<Planar> mechanism(bodies, {PlanarMarker()}, rows, {}, Eigen::Vector2d(0, -9.81));
  VectorXd state = VectorXd::Zero(mechanism.n_q + mechanism.n_v);
  const Eigen::Index second = mechanism.nodes[1].q;
  state[second] = pi / 3;
  Scene scene;
  scene.targets = {{component(1.5)}, {component(std::sqrt(3) / 2)}};
  RecursiveMotion<Planar> motion(mechanism, scene, 0, state.data(), state.data() + mechanism.n_q);
  const auto start = std::chrono::steady_clock::now();
  double count = std::atof(given[2]);
  if (given[1][0] == 'e') {
    const double target[2] = {-0.9, -0.5};
    VectorXd a(mechanism.n_v), v = VectorXd::Zero(mechanism.n_v);
    for (int i = 0; i < modes; ++i)
      state[1 + i] = 1e-4 / (1 + i), state[second + 1 + i] = 1e-4 / (11 + i);
    v[0] = -0.3, v[second] = 0.6;
    for (int i = 0; i < count; ++i)
      accelerations(state.data(), v.data(), Forces<double>(), target, motion.workspace(), a.data());
  } else {
    motion.project(0, state.data(), state.data() + mechanism.n_q);
    std::vector<double> times;
    for (int i = 0; i <= 100 * count; ++i)
      times.push_back(0.01 * i);
    IntegrationControls controls;
    controls.tolerance = 1e-4;
    const IntegrationReport report = integrate(
        motion, times, state, controls, [](std::size_t, double, const double *) {}, [](double) { return true; });
    std::printf("%lu steps, %lu rejected, %lu evaluations; force %.12g %.12g N\n", report.steps, report.rejected,
                report.evaluations, motion.workspace().lambda[0], motion.workspace().lambda[1]);
    count = static_cast<double>(report.steps);
  }
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  std::printf("%.4f\n", 1e6 * seconds / count);
}
