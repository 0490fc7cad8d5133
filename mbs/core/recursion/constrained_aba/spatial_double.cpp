#include "core/recursion/constrained_aba/evaluation.h"
#include "core/recursion/constrained_aba/once.h"

namespace ffrobot::recursion {

FFROBOT_EVALUATION(Spatial, double);
FFROBOT_RESPONSES(Spatial);
FFROBOT_ONCE(template, Spatial);
FFROBOT_ONCE_SPATIAL(template);

} // namespace ffrobot::recursion
