#include "core/recursion/constrained_aba/evaluation.h"
#include "core/recursion/constrained_aba/once.h"

namespace ffrobot::recursion {

FFROBOT_EVALUATION(Planar, double);
FFROBOT_RESPONSES(Planar);
FFROBOT_ONCE(template, Planar);
FFROBOT_ONCE_PLANAR(template);

} // namespace ffrobot::recursion
