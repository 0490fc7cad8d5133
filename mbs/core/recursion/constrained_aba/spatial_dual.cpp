#include "core/recursion/numbers/dual.h"

#include "core/recursion/constrained_aba/evaluation.h"

namespace ffrobot::recursion {

FFROBOT_EVALUATION(Spatial, Dual);

} // namespace ffrobot::recursion
