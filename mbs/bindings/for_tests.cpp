// What tests alone look at: single pieces of the integrators, and a system with an orientation.
#include "core/integrate/integrate.h"
#include "core/space/rotation.h"

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
using Eigen::Vector3d;
using Eigen::VectorXd;
using RowMajorMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

namespace {

// A heavy top about a fixed point: q = quaternion (w, x, y, z), v = omega in body axes, n_q = 4, n_v = 3.
//     I omega_dot = (I omega) x omega + r x (A^T f)
class Top final : public ImplicitSystem {
public:
  Top(const Vector3d &inertia, const Vector3d &r, const Vector3d &f)
      : ImplicitSystem(ConfigurationSpace(3, {0})), inertia_(inertia), r_(r), f_(f) {}

  void slope(double, const double *z, double *z_dot) override {
    ++evaluations_;
    local().rate(z, z_dot);
    const double *e = local().state(z);
    const Eigen::Quaterniond orientation(e[0], e[1], e[2], e[3]);
    const Vector3d omega(z + 3), momentum = inertia_.cwiseProduct(omega);
    const Vector3d moment = momentum.cross(omega) + r_.cross(orientation.conjugate() * f_);
    Eigen::Map<Vector3d>(z_dot + 3) = moment.cwiseQuotient(inertia_);
  }
  bool correct(double, double *) override { return true; }
  double error_size(double, const double *z, const double *e) override { return change_size(z, e, 0); }
  void accepted(double, const double *, const double *) override {}
  bool is_sensible(const double *) const override { return true; }
  double initial_step() const override { return 1e-3; }
  unsigned long evaluations() const override { return evaluations_; }

  Index constraints() const override { return 0; }
  const VectorXd &stiffness() const override { return zero_; }
  const VectorXd &damping() const override { return zero_; }
  void factorise(double, double) override {}
  void factorise(Complex, Complex) override {}
  void solve(const double *, const double *, double *x) override { std::fill_n(x, 3, 0.0); } // nothing is stiff: r = 0
  void solve(const Complex *, Complex *x) override { std::fill_n(x, 3, Complex(0)); }
  void constrain(const double *, double *) override {}
  void constraint_values(double, const double *, double *, double *) override {}
  double value_size(const double *, const VectorXd &) const override { return 0; }
  double rate_size(const double *, const VectorXd &) const override { return 0; }
  double change_size(const double *, const double *change, double) const override {
    return Eigen::Map<const VectorXd>(change, 6).lpNorm<Eigen::Infinity>();
  }

private:
  Vector3d inertia_, r_, f_;
  VectorXd zero_ = VectorXd::Zero(3);
  unsigned long evaluations_ = 0;
};

// States (2 steps + 1, n_q + n_v) of equal steps: where they end and, by dense output, in their middle.
RowMajorMatrix equal_steps(ImplicitSystem &system, const VectorXd &y, double end, int steps,
                           const MethodChoice &choice) {
  constexpr double newton_tolerance = 1e-8;
  LocalCoordinates &local = system.local();
  const auto made = make_method(choice, system);
  Method &method = *made;
  VectorXd z(system.size()), middle(system.size());
  RowMajorMatrix states(2 * steps + 1, y.size());
  const auto put = [&](int row, const double *at) {
    states.row(row) = Eigen::Map<const Eigen::RowVectorXd>(local.state(at), y.size());
  };
  local.set_centre(y.data());
  local.from_state(y.data(), z.data());
  put(0, z.data());
  const double h = end / steps;
  system.slope(0, z.data(), method.first_slope());
  system.accepted(0, z.data(), method.first_slope());
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

VectorXd joined(const VectorXd &q, const VectorXd &v) {
  VectorXd y(q.size() + v.size());
  y << q, v;
  return y;
}

template <class Space>
RowMajorMatrix tree_fixed_steps(const recursion::Model<Space> &model, const recursion::Scene &scene, double end,
                                int steps, const VectorXd &q, const VectorXd &v, MethodKind kind,
                                double spectral_radius) {
  model.check_state(q, v);
  recursion::RecursiveMotion<Space> motion(model.mechanism, scene, 0, q.data(), v.data());
  motion.plan(end);
  return equal_steps(motion, joined(q, v), end, steps, {kind, spectral_radius});
}

template <class Space> void bind_fixed_steps(nb::module_ &m) {
  m.def("tree_fixed_steps", &tree_fixed_steps<Space>, "model"_a, "scene"_a, "end"_a, "steps"_a, "q"_a, "v"_a,
        "method"_a, "spectral_radius"_a,
        "States after equal steps and in their middle (2 steps + 1, n_q + n_v), for convergence studies.");
}

RowMajorMatrix top_fixed_steps(const Vector3d &inertia, const Vector3d &r, const Vector3d &f, double end, int steps,
                               const Eigen::Vector4d &q, const Vector3d &v, MethodKind kind, double spectral_radius) {
  Top top(inertia, r, f);
  return equal_steps(top, joined(q, v), end, steps, {kind, spectral_radius});
}

// States (T, 7) of an adaptive integration at `times`.
RowMajorMatrix top_motion(const Vector3d &inertia, const Vector3d &r, const Vector3d &f,
                          const std::vector<double> &times, const Eigen::Vector4d &q, const Vector3d &v,
                          const IntegrationControls &controls) {
  Top top(inertia, r, f);
  RowMajorMatrix states(static_cast<Index>(times.size()), 7);
  VectorXd y = joined(q, v);
  const auto report = integrate(
      top, times, y, controls,
      [&](std::size_t i, double, const double *at) {
        states.row(static_cast<Index>(i)) = Eigen::Map<const Eigen::RowVectorXd>(at, 7);
      },
      [](double) { return true; }, nullptr);
  if (report.status != IntegrationStatus::completed)
    throw std::runtime_error("the motion of the top ended at t = " + std::to_string(report.time));
  return states;
}

} // namespace

void bind_for_tests(nb::module_ &m) {
  bind_fixed_steps<recursion::Planar>(m);
  bind_fixed_steps<recursion::Spatial>(m);
  m.def("top_fixed_steps", &top_fixed_steps, "inertia"_a, "r"_a, "f"_a, "end"_a, "steps"_a, "q"_a, "v"_a, "method"_a,
        "spectral_radius"_a, "As tree_fixed_steps, of a heavy top: q = (w, x, y, z), v = omega in body axes.");
  m.def("top_motion", &top_motion, "inertia"_a, "r"_a, "f"_a, "times"_a, "q"_a, "v"_a, "controls"_a,
        "States (T, 7) of a heavy top.");
}
