#include <nanobind/nanobind.h>

#include "bindings/bindings.h"

NB_MODULE(_core, m) {
  m.doc() = "Compiled core of ffrobot: planar floating-frame dynamics.";
  bind_time_function(m);
  bind_system(m);
  bind_run(m);
}
