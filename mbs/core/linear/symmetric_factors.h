// L D L^T of a dense symmetric matrix without pivoting, real or complex: A = L D L^T, not L D L^H. For many unknowns;
// recursion/numbers/multipliers.h has the few multipliers of one evaluation, of any kind of numbers.
#pragma once

#include "core/eigen.h"

namespace ffrobot {

// The lower half of A (n, n) becomes L and 1/D.
template <class Scalar> void factorise_symmetric(Matrix<Scalar, Dynamic, Dynamic> &A);

// x (n) in place, with these factors
template <class Scalar>
void solve_symmetric(const Matrix<Scalar, Dynamic, Dynamic> &factors, Matrix<Scalar, Dynamic, 1> &x);

} // namespace ffrobot
