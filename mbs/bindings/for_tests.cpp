// What tests alone look at: steps of the integrators.
#include "core/integrate/integrate.h"

#include <nanobind/eigen/dense.h>
#include <nanobind/nanobind.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <stdexcept>

#include "bindings/recursion/recursion.h"

namespace nb = nanobind;
using namespace nb::literals;
using namespace ffrobot;
using Eigen::Index;
using Eigen::VectorXd;
using RowMajorMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

namespace {

// States (2 steps + 1, n_q + n_v) of equal steps: where they end and, by dense output, in their middle.
template <class Space>
RowMajorMatrix tree_fixed_steps(const recursion::Model<Space> &model, const recursion::Scene &scene, double end,
                                int steps, const VectorXd &q, const VectorXd &v, MethodKind kind,
                                double spectral_radius) {
  constexpr double newton_tolerance = 1e-8;
  model.check_state(q, v);
  recursion::RecursiveMotion<Space> motion(model.mechanism, scene, 0, q.data(), v.data());
  motion.plan(end);
  const auto made = make_method({kind, spectral_radius}, motion);
  Method &method = *made;
  LocalCoordinates &local = motion.local();
  VectorXd y(q.size() + v.size()), z(motion.size()), middle(z);
  RowMajorMatrix states(2 * steps + 1, y.size());
  const auto put = [&](int row, const double *at) {
    states.row(row) = Eigen::Map<const Eigen::RowVectorXd>(local.state(at), y.size());
  };
  y << q, v;
  local.set_centre(y.data()), local.from_state(y.data(), z.data());
  put(0, z.data());
  const double h = end / steps;
  motion.slope(0, z.data(), method.first_slope());
  motion.accepted(0, z.data(), method.first_slope());
  for (int i = 0; i < steps; ++i) {
    if (!method.step(i * h, z.data(), h, newton_tolerance) || !method.finish((i + 1) * h))
      throw std::runtime_error("the equations of step " + std::to_string(i) + " could not be solved");
    method.prepare_dense(i * h, z.data(), h);
    method.interpolate((i + 0.5) * h, middle.data());
    put(2 * i + 1, middle.data());
    method.accept(h);
    std::copy_n(method.end(), z.size(), z.data());
    put(2 * i + 2, z.data());
    std::copy_n(method.last_slope(), z.size(), method.first_slope());
    if (local.recentre(z.data(), method.first_slope()))
      method.recentred();
  }
  return states;
}

template <class Space> void bind_fixed_steps(nb::module_ &m) {
  m.def("tree_fixed_steps", &tree_fixed_steps<Space>, "model"_a, "scene"_a, "end"_a, "steps"_a, "q"_a, "v"_a,
        "method"_a, "spectral_radius"_a,
        "States after equal steps and in their middle (2 steps + 1, n_q + n_v), for convergence studies.");
}

} // namespace

void bind_for_tests(nb::module_ &m) {
  bind_fixed_steps<recursion::Planar>(m);
  bind_fixed_steps<recursion::Spatial>(m);
}
