#include <nanobind/nanobind.h>

namespace nb = nanobind;

NB_MODULE(_core, m) { m.doc() = "Compiled core of ffrobot: planar floating-frame dynamics."; }
