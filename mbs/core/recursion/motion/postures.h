// Postures that keep to constraint equations: what these measure at many states, and Newton's method onto them.
#pragma once

#include "core/recursion/motion/scene.h"
#include "core/recursion/newton_euler/newton_euler.h"

namespace ffrobot::recursion {

// C_v (constraints, n_v) at q (n_q): row by row the generalized forces of a unit multiplier, by virtual work. `w` has
// the kinematics of q at rest afterwards.
template <class Space> MatrixXd gradients(const double *q, Workspace<Space, double> &w);

// Newton's method onto a posture: off() says how far it is and finds a step, go() makes it. What is left in the end:
// below `tolerance`, or below `floor` and not falling any more, or NaN; or what is left of the last iteration.
template <class Off, class Go> double iterate_to_posture(double tolerance, double floor, const Off &off, const Go &go) {
  constexpr int most_iterations = 60;
  double left = 0, previous = 1e300;
  for (int i = 0; i < most_iterations; ++i) {
    left = off();
    if (!std::isfinite(left) || left <= tolerance || (left <= floor && left > 0.2 * previous))
      break;
    previous = left;
    go();
  }
  return left;
}

struct PostureSearch {
  VectorXd scales;         // (n_v) natural sizes of coordinates; those of size 0 stay
  VectorXd sizes;          // (constraints) natural sizes of values
  double largest_step = 1; // of any coordinate, in natural sizes: keeps to the branch of the guess
};

// Of constraint equations over states: a row for each of T times, q (n_q), v (n_v). All that it is made from must
// outlive it; `w` is worked with.
template <class Space> class Postures {
public:
  Postures(const Scene &scene, Workspace<Space, double> &w);

  // Values less targets (T, constraints), m or rad, of which full turns do not count, and C_v (T, constraints n_v), row
  // by row
  std::pair<RowMajor, RowMajor> constraints(const std::vector<double> &times, const RowMajor &q);

  // Rates less those of targets (T, constraints)
  RowMajor rates(const std::vector<double> &times, const RowMajor &q, const RowMajor &v);

  // q moved onto the constraint equations by the least steps, and the largest residual (T) that is left, in natural
  // sizes; NaN where it is not finite. `beside` (T, constraints; or empty) adds to targets.
  std::pair<RowMajor, VectorXd> solve(const std::vector<double> &times, RowMajor q, const RowMajor &beside,
                                      const PostureSearch &search);

private:
  void go_to(double t);
  void measure(const double *q, const double *v); // less targets

  const Scene &scene_;
  Workspace<Space, double> &w_;
  NewtonEuler<Space> forces_;
  std::vector<Jet> targets_;
  VectorXd value_, rate_, still_;
};

} // namespace ffrobot::recursion
