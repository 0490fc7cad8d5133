#include "core/analysis/allocation.h"

#include <nanobind/eigen/dense.h>

#include "bindings/bindings.h"

namespace {

// Voltages (T, k) for modal forces (T, n), one after the other
RowMajor allocate(Allocation &allocation, const RowMajor &F_p) {
  RowMajor V(F_p.rows(), allocation.Phi().cols());
  for (Index i = 0; i < F_p.rows(); ++i)
    V.row(i) = allocation.solve(F_p.row(i).transpose()).transpose();
  return V;
}

} // namespace

void bind_allocation(nb::module_ &m) {
  nb::class_<Allocation>(m, "Allocation", "Voltages of k patches within limits by bounded weighted least squares.")
      .def(nb::init<MatrixXd, const MatrixXd &, MatrixXd, VectorXd, VectorXd, VectorXd>(), "Phi"_a, "W_sqrt"_a,
           "gain"_a, "lower"_a, "upper"_a, "scale"_a)
      .def("solve", &allocate, "F_p"_a,
           "Voltages (T, k), V, for modal forces (T, n), N/sqrt(kg); each solve starts at the one before.")
      .def_prop_ro("iterations", &Allocation::iterations);
}
