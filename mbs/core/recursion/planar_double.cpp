#include "core/recursion/accelerations.h"
#include "core/recursion/cut_forces.h"

namespace ffrobot::recursion {

using M = Mechanism<Planar>;
using W = Workspace<Planar, double>;

template struct Workspace<Planar, double>;
template void accelerations(const M &, const double *, const double *, const Forces<double> &, const double *, W &,
                            double *);
template void respond(const M &, const double *, const double *, W &, double *);
template void response(const M &, const double *, const double *, W &, double *);
template void measure(const M &, const double *, const double *, W &, double *, double *);
template void place_all(const M &, const double *, const double *, const Forces<double> &, W &);
template Pose<double> wrench_pose(const M &, int, const W &);
template void cut_rates(const M &, const std::vector<CutJoint> &, const W &, double *);
template void add_along_cuts(const M &, const std::vector<CutJoint> &, const double *, const W &, double *);

} // namespace ffrobot::recursion
