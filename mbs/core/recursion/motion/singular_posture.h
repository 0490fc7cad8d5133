// How far a mechanism is from a posture in which its joints cannot follow a path in every direction.
#pragma once

#include "core/fields.h"
#include "core/recursion/mechanism/workspace.h"

namespace ffrobot::recursion {

// Modes let constraints stay independent there: the equations do not fail, while motors' forces and rates grow.
struct PostureWatch {
  std::vector<char> is_path; // of each constraint equation; others close loops
  double length = 1;         // m: ways count in terms of it
};

// The worst of the postures that were looked at, and the last one: ratio and determinant of Mobility.
struct PostureHistory {
  double least_ratio = 1, singular_at = 0; // 1 before the first, or without a path; s
  VectorXd singular_posture;               // q there
  double watched_at = 0, determinant = 0;  // s; of the last

  FFROBOT_FIELDS(least_ratio, singular_at, singular_posture, watched_at, determinant);
};

// Looks at q (n_q) at time t (s), working with `w`; between postures whose determinants differ in sign there is a
// singular one.
template <class Space>
void look(const PostureWatch &watch, double t, const double *q, Workspace<Space, double> &w, PostureHistory &history);

} // namespace ffrobot::recursion
