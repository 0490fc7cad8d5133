// How the joints of a mechanism can move at a posture: ranks and singular ratios of loops and of a path.
#pragma once

#include "core/linear/dense.h"
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

// With rigid links. Rates are in radians, ways in lengths of the watch.
struct Mobility {
  RightVectors loops;  // of rates of the equations of loops by joints
  Index loop_rank = 0; // how many of these are independent
  MatrixXd free;       // (joint coordinates, freedoms) that joints and loops leave, orthonormal
  MatrixXd rates;      // of the path's equations by these
  RightVectors path;   // of `rates`

  // Smallest of largest singular value of the path's equations in the freedoms; 1 without a path
  double ratio() const { return path.ratio(rates.rows()); }
  double loop_ratio() const { return loops.ratio(loop_rank); } // the same of the loops' independent equations
  double determinant() const; // of `rates`; 0 with loops, where the basis of freedoms has no sign, and of others
  Index followed() const;     // how many of the freedoms the path takes
  MatrixXd left() const;      // (joint coordinates, m) motions with the path held
  VectorXd hardest() const;   // (joint coordinates) motion that the path follows least
};

// At q; `w` is worked with. Loops have `loop_rank`, or, where that is negative, what they have here: bent links raise
// it, and joints seem to be locked that the links let move.
template <class Space>
Mobility mobility(const PostureWatch &watch, const double *q, Workspace<Space, double> &w, Index loop_rank = -1);

} // namespace ffrobot::recursion
