// Which constraint equations say something that the others do not.
#pragma once

#include "core/recursion/mechanism/workspace.h"

namespace ffrobot::recursion {

// Sets workspace.active to such constraints, `most` at most, found by pivoting in C M^-1 C^T at the state (q, v): what
// is left of a dependent constraint's diagonal after elimination is rounding, and more where it does not hold.
template <class Space>
void keep_independent_constraints(const double *q, const double *v, Workspace<Space, double> &w, std::size_t most = -1);

} // namespace ffrobot::recursion
