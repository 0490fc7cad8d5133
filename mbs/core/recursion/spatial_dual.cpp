#include "core/recursion/dual.h"

#include "core/recursion/accelerations.h"

namespace ffrobot::recursion {

using M = Mechanism<Spatial>;
using W = Workspace<Spatial, Dual>;

template struct Workspace<Spatial, Dual>;
template void accelerations(const M &, const Dual *, const Dual *, const Forces<Dual> &, const Dual *, W &, Dual *);
template void measure(const M &, const Dual *, const Dual *, W &, Dual *, Dual *);

} // namespace ffrobot::recursion
