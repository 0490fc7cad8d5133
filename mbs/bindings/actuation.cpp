#include "core/actuation/actuators.h"
#include "core/actuation/allocation.h"
#include "core/actuation/points.h"
#include "core/actuation/side_by_side.h"
#include "core/actuation/source.h"

#include <nanobind/eigen/dense.h>
#include <nanobind/nanobind.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include "bindings/bindings.h"

namespace nb = nanobind;
using namespace nb::literals;
using namespace ffrobot;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using RowMajorMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

namespace {

// Voltages (T, k) for modal forces (T, n), one after the other
RowMajorMatrix allocate(Allocation &allocation, const RowMajorMatrix &F_p) {
  RowMajorMatrix V(F_p.rows(), allocation.Phi().cols());
  for (Index i = 0; i < F_p.rows(); ++i)
    V.row(i) = allocation.solve(F_p.row(i).transpose()).transpose();
  return V;
}

VectorXd joined(const std::vector<VectorXd> &parts) {
  Index size = 0;
  for (const auto &part : parts)
    size += part.size();
  VectorXd whole(size);
  collect(parts, 0, whole);
  return whole;
}

// What a source gives at `times`: tau (T, motors) and F_p (T, modes of all bodies)
std::tuple<RowMajorMatrix, RowMajorMatrix> sample(ActuationSource &source, const std::vector<double> &times) {
  const auto T = static_cast<Index>(times.size());
  RowMajorMatrix tau, F_p;
  for (Index i = 0; i < T; ++i) {
    source.evaluate(times[static_cast<std::size_t>(i)]);
    const VectorXd modal = joined(source.modal_force());
    if (i == 0)
      tau.resize(T, source.tau().size()), F_p.resize(T, modal.size());
    tau.row(i) = source.tau().transpose();
    F_p.row(i) = modal.transpose();
  }
  return {tau, F_p};
}

void bind_sources(nb::module_ &m) {
  nb::class_<ExternalLoads>(m, "ExternalLoads", "Loads from outside a system's own.");
  nb::class_<ActuationSource>(m, "ActuationSource", "What an inverse analysis found, at any time of it.")
      .def("sample", &sample, "times"_a, "tau (T, motors) and F_p (T, modes of all bodies).");
}

void bind_actuators(nb::module_ &m) {
  nb::class_<Actuator>(m, "Actuator", "Acts on a forward run as an inverse analysis tells it to.");
  nb::class_<TrajectoryForces, Actuator>(m, "TrajectoryForces", "Forces that held the trajectories, on their points.")
      .def(nb::init<std::size_t>(), "first_drive"_a);
  nb::class_<Motors, Actuator>(m, "Motors", "Motor forces, each cut at its limit.")
      .def(nb::init<std::size_t, VectorXd>(), "first_drive"_a, "limit"_a);
  nb::class_<Patches, Actuator>(m, "Patches", "Modal forces of a link, as far as its patches go.")
      .def(nb::init<std::size_t, Allocation>(), "body"_a, "allocation"_a);
  nb::class_<PointForces, Actuator>(m, "PointForces", "Generalized forces of one body at its actuation points.")
      .def(nb::init<std::size_t, std::size_t, ActuationPoints>(), "first_drive"_a, "body"_a, "points"_a);
  nb::class_<Actuation, ExternalLoads>(m, "Actuation", "An inverse analysis and the actuators that carry it out.")
      .def(nb::init<std::shared_ptr<ActuationSource>, std::vector<std::shared_ptr<Actuator>>>(), "source"_a,
           "actuators"_a);
}

} // namespace

void bind_actuation(nb::module_ &m) {
  bind_sources(m);
  nb::class_<Allocation>(m, "Allocation", "Voltages within limits by bounded weighted least squares.")
      .def(nb::init<MatrixXd, const MatrixXd &, MatrixXd, VectorXd, VectorXd>(), "Phi"_a, "W_sqrt"_a, "gain"_a,
           "limit"_a, "scale"_a)
      .def("solve", &allocate, "F_p"_a, "Voltages (T, k) for modal forces (T, n); each solve starts at the one before.")
      .def_prop_ro("iterations", &Allocation::iterations);

  nb::class_<ActuationPoints>(m, "ActuationPoints", "Generalized forces of a body as forces at points of it.")
      .def(nb::init<Eigen::Matrix2Xd, Eigen::Matrix2Xd, MatrixXd, VectorXd>(), "direction"_a, "position"_a, "Phi"_a,
           "scale"_a)
      .def("L_a", &ActuationPoints::L_a, "p"_a, nb::rv_policy::copy)
      .def(
          "solve",
          [](ActuationPoints &points, double theta, const VectorXd &p, const VectorXd &Q_a) {
            return points.solve(theta, p, Q_a);
          },
          "theta"_a, "p"_a, "Q_a"_a);

  bind_actuators(m);
}
