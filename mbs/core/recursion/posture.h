// How far a mechanism is from a posture in which its joints cannot follow a
// path in every direction.
#pragma once

#include "core/recursion/workspace.h"

namespace ffrobot::recursion {

// Modes let constraints stay independent there: the equations do not fail,
// while motors' forces and rates grow.
struct PostureWatch {
  std::vector<char> is_path; // of each row; others close loops
  double length = 1;         // m: ways count in terms of it
};

struct Posture {
  // Smallest of largest singular value of the path's rows in the freedoms that
  // joints and loops have with rigid links; 1 without such rows
  double ratio = 1;
  double determinant = 0; // where its sign means something: it changes in a
                          // singular posture
};

// At q; leaves the kinematics of `w` there, at rest.
template <class Space>
Posture posture_at(const Mechanism<Space> &m, const PostureWatch &watch, const double *q, Workspace<Space, double> &w);

} // namespace ffrobot::recursion
