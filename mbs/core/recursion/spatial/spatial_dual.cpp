#include "core/recursion/numbers/dual.h"

#include "core/recursion/constrained_aba/evaluation.h"
#include "core/recursion/constrained_aba/loop_joint_forces.h"

namespace ffrobot::recursion {

using M = Mechanism<Spatial>;
using W = Workspace<Spatial, Dual>;

template struct Workspace<Spatial, Dual>;
template Placed<Spatial, Dual> place_all(const M &, const Dual *, const Dual *, const Dual *, W &);
template void accelerations(const Placed<Spatial, Dual> &, const Dual *, const Dual *, Dual *);
template void accelerations(const M &, const Dual *, const Dual *, const Forces<Dual> &, const Dual *, W &, Dual *);
template Placed<Spatial, Dual> measure(const M &, const Dual *, const Dual *, W &, Dual *, Dual *);
template Pose<Dual> wrench_pose(const Placed<Spatial, Dual> &, int);
template void cut_rates(const Placed<Spatial, Dual> &, const std::vector<CutJoint> &, Dual *);
template void add_along_cuts(const Placed<Spatial, Dual> &, const std::vector<CutJoint> &, const Dual *, Dual *);

} // namespace ffrobot::recursion
