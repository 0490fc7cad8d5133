#include "core/recursion/dual.h"

#include "core/recursion/accelerations.h"
#include "core/recursion/cut_forces.h"

namespace ffrobot::recursion {

using M = Mechanism<Spatial>;
using W = Workspace<Spatial, Dual>;

template struct Workspace<Spatial, Dual>;
template void accelerations(const M &, const Dual *, const Dual *, const Forces<Dual> &, const Dual *, W &, Dual *);
template void measure(const M &, const Dual *, const Dual *, W &, Dual *, Dual *);
template void place_all(const M &, const Dual *, const Dual *, const Forces<Dual> &, W &);
template Pose<Dual> wrench_pose(const M &, int, const W &);
template void cut_rates(const M &, const std::vector<CutJoint> &, const W &, Dual *);
template void add_along_cuts(const M &, const std::vector<CutJoint> &, const Dual *, const W &, Dual *);

} // namespace ffrobot::recursion
