#include "core/analysis/sampled.h"

#include <nanobind/eigen/dense.h>
#include <nanobind/nanobind.h>
#include <nanobind/stl/function.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include "bindings/analysis/analysis.h"
#include "bindings/bindings.h"

namespace nb = nanobind;
using namespace nb::literals;
using namespace ffrobot;
using Eigen::Index;
using Eigen::VectorXd;

namespace {

using Controller = std::function<VectorXd(std::size_t, double, const VectorXd &)>;

void make_sensing(Sensing *sensing, const System &system, const std::vector<std::pair<Measure, int>> &rows,
                  const std::vector<std::tuple<std::size_t, VectorXd, int>> &modes) {
  std::vector<Sensing::AlongRow> along;
  std::vector<Sensing::OfModes> of;
  for (const auto &[row, order] : rows)
    along.push_back({row, order});
  for (const auto &[body, vector, order] : modes)
    of.push_back({body, vector, order});
  new (sensing) Sensing(system, std::move(along), std::move(of));
}

RowMajorMatrix read_all(Sensing &sensing, const RowMajorMatrix &q, const RowMajorMatrix &v, const RowMajorMatrix &a) {
  check_size("v rows", v.rows(), q.rows());
  check_size("a rows", a.rows(), q.rows());
  RowMajorMatrix readings(q.rows(), sensing.count());
  for (Index i = 0; i < q.rows(); ++i)
    readings.row(i) = sensing.read(q.row(i).data(), v.row(i).data(), a.row(i).data()).transpose();
  return readings;
}

Run run_under_controller(const System &system, std::vector<int> groups, std::vector<bool> moments,
                         std::vector<Measure> joints, const std::vector<double> &times, const VectorXd &q,
                         const VectorXd &v, const IntegrationControls &controls,
                         const std::function<bool(double)> &carry_on, std::size_t motors,
                         std::vector<HeldCommands::Patches> patches, const VectorXd &first_command, Sensing &sensing,
                         const std::vector<double> &samples, double delay, const Controller &controller) {
  check_size("q", q.size(), system.n_q());
  check_size("v", v.size(), system.n_v());
  const nb::gil_scoped_release unlocked;
  HeldCommands commands(motors, std::move(patches));
  commands.set(first_command);
  ConstrainedMotion motion(system, {system, {std::move(groups), std::move(moments), std::move(joints)}}, &commands);
  return run_sampled(motion, times, q, v, controls, commands, sensing, {samples, delay, locked(controller)},
                     locked(carry_on));
}

} // namespace

void bind_sampled(nb::module_ &m) {
  nb::class_<Sensing>(m, "Sensing", "What sensors read of a state: rows, then modal coordinates, or their rates.")
      .def("__init__", &make_sensing, "system"_a, "rows"_a, "modes"_a, nb::keep_alive<1, 2>())
      .def("read", &read_all, "q"_a, "v"_a, "a"_a, "Readings (T, sensors) of q (T, n_q), v and a (T, n_v).");
  m.def("run_sampled", &run_under_controller, nb::kw_only(), "system"_a, "groups"_a, "moments"_a, "joints"_a, "times"_a,
        "q"_a, "v"_a, "controls"_a, "carry_on"_a, "motors"_a, "patches"_a, "first_command"_a, "sensing"_a, "samples"_a,
        "delay"_a, "controller"_a, "As run, under commands that `controller`(k, t, readings) gives at samples.");
}
