// Products with matrices of a few rows, where Eigen's have more instructions around them than in them.
#pragma once

#include "core/recursion/numbers/pack.h"

#include "core/eigen.h"

namespace ffrobot {

// y (rows) = A x
inline void multiply_small(const MatrixXd &A, const double *x, double *y) {
  const long rows = A.rows(), columns = A.cols();
  recursion::in_registers(rows, [&]<int w>(long i) {
    using Part = recursion::Pack<double, w>;
    const double *column = A.data() + i;
    Part sum = Part::zero();
    for (long k = 0; k < columns; ++k, column += rows)
      sum += x[k] * Part::read(column);
    sum.write(y + i);
  });
}

} // namespace ffrobot
