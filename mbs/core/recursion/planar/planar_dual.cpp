#include "core/recursion/numbers/dual.h"

#include "core/recursion/constrained_aba/evaluation.h"
#include "core/recursion/constrained_aba/loop_joint_forces.h"

namespace ffrobot::recursion {

using M = Mechanism<Planar>;
using W = Workspace<Planar, Dual>;

template struct Workspace<Planar, Dual>;
template Placed<Planar, Dual> place_all(const M &, const Dual *, const Dual *, const Dual *, W &);
template void accelerations(const Placed<Planar, Dual> &, const Dual *, const Dual *, Dual *);
template void accelerations(const M &, const Dual *, const Dual *, const Forces<Dual> &, const Dual *, W &, Dual *);
template Placed<Planar, Dual> measure(const M &, const Dual *, const Dual *, W &, Dual *, Dual *);
template Pose<Dual> wrench_pose(const Placed<Planar, Dual> &, int);
template void cut_rates(const Placed<Planar, Dual> &, const std::vector<CutJoint> &, Dual *);
template void add_along_cuts(const Placed<Planar, Dual> &, const std::vector<CutJoint> &, const Dual *, Dual *);

} // namespace ffrobot::recursion
