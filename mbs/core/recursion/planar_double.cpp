#include "core/recursion/accelerations.h"

namespace ffrobot::recursion {

using M = Mechanism<Planar>;
using W = Workspace<Planar, double>;

template struct Workspace<Planar, double>;
template void accelerations(const M &, const double *, const double *, const Forces<double> &, const double *, W &,
                            double *);
template void response(const M &, const double *, const double *, W &, double *);
template void measure(const M &, const double *, const double *, W &, double *, double *);

} // namespace ffrobot::recursion
