#include "core/analysis/sampled.h"

#include <nanobind/eigen/dense.h>
#include <nanobind/nanobind.h>
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

} // namespace

void bind_sensing(nb::module_ &m) {
  nb::class_<Sensing>(m, "Sensing", "What sensors read of a state: rows, then modal coordinates, or their rates.")
      .def("__init__", &make_sensing, "system"_a, "rows"_a, "modes"_a, nb::keep_alive<1, 2>())
      .def("read", &read_all, "q"_a, "v"_a, "a"_a, "Readings (T, sensors) of q (T, n_q), v and a (T, n_v).");
}
