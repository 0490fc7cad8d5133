#include "core/recursion/constrained_aba/evaluation.h"
#include "core/recursion/constrained_aba/loop_joint_forces.h"
#include "core/recursion/constrained_aba/once.h"

namespace ffrobot::recursion {

using M = Mechanism<Planar>;
using W = Workspace<Planar, double>;

template struct Workspace<Planar, double>;
template Placed<Planar, double> place_all(const M &, const double *, const double *, const double *, W &);
template void accelerations(const Placed<Planar, double> &, const double *, const double *, double *);
template void accelerations(const M &, const double *, const double *, const Forces<double> &, const double *, W &,
                            double *);
template void respond(const M &, const double *, const double *, W &, double *);
template void response(const M &, const double *, const double *, W &, double *);
template Placed<Planar, double> measure(const M &, const double *, const double *, W &, double *, double *);
template Pose<double> wrench_pose(const Placed<Planar, double> &, int);
template void cut_rates(const Placed<Planar, double> &, const std::vector<CutJoint> &, double *);
template void add_along_cuts(const Placed<Planar, double> &, const std::vector<CutJoint> &, const double *, double *);
FFROBOT_ONCE(template, Planar);
FFROBOT_ONCE_PLANAR(template);

} // namespace ffrobot::recursion
