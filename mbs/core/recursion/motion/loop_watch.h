// Whether a step leads to, or across, a posture in which constraints depend on each other, as those of a parallelogram
// that turns flat. Branches of the motion meet there, and rounding would decide between them. A step can jump over the
// posture, but det C M^-1 C_0^T, C_0 being C at an earlier step, changes its sign where the motion keeps to its branch:
// near the posture C is a sum of dyads, one of which goes through zero. Next to it branches are closer to each other
// than constraints are kept, and a step can change to another one, along which the sign stays: so none ends there.
#pragma once

#include "core/recursion/mechanism/workspace.h"

namespace ffrobot::recursion {

template <class Space> class LoopWatch {
public:
  // `w` has accelerations() at a posture that counts as regular.
  explicit LoopWatch(const Workspace<Space, double> &w);

  // C_0 at q (n_q). `w`: as accelerations() near q have left it; `other` becomes one at rest.
  void begin_at(const double *q, const Workspace<Space, double> &w, Workspace<Space, double> &other);
  bool has_begun() const { return C_0_.rows() > 0; }

  // Cosine of the angle between the spaces of constraints at q and where it began,
  // det C M^-1 C_0^T / sqrt(det C M^-1 C^T det C_0 M_0^-1 C_0^T): free of units; 0 next to a singular posture.
  // `w` has accelerations() at q; what it has of ports and sections is something else afterwards.
  double cosine(const double *q, Workspace<Space, double> &w);
  bool is_far() const { return cosine_ < 0.5; }          // it is time to begin where the last cosine was found
  bool is_poor(const Workspace<Space, double> &w) const; // active constraints hardly differ, beside those of the begin

private:
  MatrixXd C_0_, product_;       // (active constraints, n_v), (active constraints, active constraints)
  VectorXd multiplier_, answer_; // (constraints), (n_v)
  double volume_, least_volume_; // sqrt(det C M^-1 C^T): where C_0 is; next to singular postures
  double cosine_ = 1;
};

} // namespace ffrobot::recursion
