// Which constraint equations say something that the others do not.
#pragma once

#include "core/recursion/mechanism/workspace.h"

namespace ffrobot::recursion {

// Constraints to keep, found by pivoting in C M^-1 C^T at the state (q, v): what is left of a dependent constraint's
// diagonal after elimination is rounding. Sets workspace.active. To be called where a run starts: no step looks again.
template <class Space>
std::vector<int> keep_independent_constraints(const double *q, const double *v, Workspace<Space, double> &w);

} // namespace ffrobot::recursion
