// What a whole analysis reports.
#pragma once

#include "core/integrate/integrate.h"

#include <Eigen/Core>

namespace ffrobot {

using RowMajorMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// One row per output time that was reached.
struct Outputs {
  RowMajorMatrix q, v, a;     // (T, coordinates) each
  RowMajorMatrix lambda;      // (T, constraints)
  RowMajorMatrix tau, F_p;    // (T, motors) and (T, modes of all bodies); empty where motors' forces are not asked for
  RowMajorMatrix shape_force; // (T, modes of all bodies) -lambda_p; empty where no shape is prescribed
  RowMajorMatrix residual;    // (T, 3) of C, C_dot, C_ddot: relative to the size of their terms
};

struct Run {
  IntegrationReport report;
  Outputs outputs;
  Eigen::VectorXd last; // (q, v) at report.time
};

} // namespace ffrobot
