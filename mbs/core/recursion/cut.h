// Joints at which loops are cut. They have no coordinate in the tree; what acts along theirs acts on the two sections,
// as a moment or force on the second one and its opposite on the first.
#pragma once

#include "core/recursion/friction.h"
#include "core/recursion/workspace.h"

#include <vector>

namespace ffrobot::recursion {

// A coordinate of such a joint, of the section on which wrench b of the mechanism acts on that of wrench a: the turn
// about (rad), or the way along (m), an axis of a.
struct CutJoint {
  int a = 0, b = 0; // wrenches
  bool turns = true;
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ(); // in axes of section a
  Friction friction;
  double stiffness = 0; // N m/rad, of a spring about 0: of turns in the plane alone
  int coordinate = -1; // in v (and q, in the plane); what is measured is less this joint coordinate, where there is one
};

// Rates (cuts) rad/s, m/s at the state of the last place_all(); of sections alone.
template <class Space, class T>
void cut_rates(const Mechanism<Space> &m, const std::vector<CutJoint> &cuts, const Workspace<Space, T> &w, T *rate);

// Turns (cuts) rad, at that state; of sections alone, of those that turn, in the plane.
template <class Space, class T>
void cut_turns(const Mechanism<Space> &m, const std::vector<CutJoint> &cuts, const Workspace<Space, T> &w, T *turn);

// Adds moments (N m) or forces (N) of `size` (cuts) along the coordinates to wrenches (wrenches, dim), at that state.
template <class Space, class T>
void add_along_cuts(const Mechanism<Space> &m, const std::vector<CutJoint> &cuts, const T *size,
                    const Workspace<Space, T> &w, T *wrench);

// Takes joint coordinates off what was found, by q (n_q) or v (n_v).
inline void take_coordinates_off(const std::vector<CutJoint> &cuts, const double *x, double *found) {
  for (std::size_t k = 0; k < cuts.size(); ++k)
    if (cuts[k].coordinate >= 0)
      found[k] -= x[cuts[k].coordinate];
}

} // namespace ffrobot::recursion
