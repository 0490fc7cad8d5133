// Holds everything.
#pragma once
#include "core/recursion/joint/place.h"
namespace ffrobot::recursion {
struct Weld {
  static constexpr JointShape spatial{0, 0, -1, {}}, planar{0, 0, -1, {}};
};
} // namespace ffrobot::recursion
