#include "core/recursion/constrained_aba/evaluation.h"
#include "core/recursion/constrained_aba/loop_joint_forces.h"
#include "core/recursion/constrained_aba/once.h"

namespace ffrobot::recursion {

using M = Mechanism<Spatial>;
using W = Workspace<Spatial, double>;

template struct Workspace<Spatial, double>;
template Placed<Spatial, double> place_all(const M &, const double *, const double *, const double *, W &);
template void accelerations(const Placed<Spatial, double> &, const double *, const double *, double *);
template void accelerations(const M &, const double *, const double *, const Forces<double> &, const double *, W &,
                            double *);
template void respond(const M &, const double *, const double *, W &, double *);
template void response(const M &, const double *, const double *, W &, double *);
template Placed<Spatial, double> measure(const M &, const double *, const double *, W &, double *, double *);
template Pose<double> wrench_pose(const Placed<Spatial, double> &, int);
template void cut_rates(const Placed<Spatial, double> &, const std::vector<CutJoint> &, double *);
template void add_along_cuts(const Placed<Spatial, double> &, const std::vector<CutJoint> &, const double *, double *);
FFROBOT_ONCE(template, Spatial);
FFROBOT_ONCE_SPATIAL(template);

} // namespace ffrobot::recursion
