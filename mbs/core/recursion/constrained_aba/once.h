// What evaluations share with other files that go over bodies: compiled with the evaluation of doubles
// (planar_double.cpp, spatial_double.cpp) alone.
#pragma once

#include "core/recursion/constrained_aba/constraints.h"

namespace ffrobot::recursion {

#define FFROBOT_ONCE(prefix, Space)                                                                                    \
  prefix void kinematics(const double *, const double *, const Forces<double> &, Workspace<Space, double> &);          \
  prefix void locate(const double *, Workspace<Space, double> &);                                                      \
  prefix void evaluate_inertia(const Node<Space> &, const double *, const double *, Space::State<double> &,            \
                               Pack<double, Space::dim> *, double *);                                                  \
  prefix void constraint_motion(const Constraint &, const Workspace<Space, double> &, bool, ConstraintMotion<double> &)

#define FFROBOT_ONCE_PLANAR(prefix)                                                                                    \
  prefix planar::Inertia<double> planar::bent_inertia(const planar::Body &, const double *, const double *,            \
                                                      planar::State<double> &)

#define FFROBOT_ONCE_SPATIAL(prefix)                                                                                   \
  prefix void spatial::bent_inertia(const spatial::Body &, spatial::State<double> &, const double *,                   \
                                    spatial::FrameTerms<double> &);                                                    \
  prefix void spatial::inertia_of<0>(const spatial::Body &, spatial::State<double> &, spatial::FrameTerms<double> &);  \
  prefix void spatial::inertia_of<modes_at_once>(const spatial::Body &, spatial::State<double> &,                      \
                                                 spatial::FrameTerms<double> &);                                       \
  prefix void spatial::inertia_of<2 * modes_at_once>(const spatial::Body &, spatial::State<double> &,                  \
                                                     spatial::FrameTerms<double> &);                                   \
  prefix void spatial::port_rows(const spatial::Body &, int, spatial::State<double> &, Pack<double, 6> *, double *,    \
                                 Pack<double, 6> *)

FFROBOT_ONCE(extern template, Planar);
FFROBOT_ONCE(extern template, Spatial);
FFROBOT_ONCE_PLANAR(extern template);
FFROBOT_ONCE_SPATIAL(extern template);

} // namespace ffrobot::recursion
