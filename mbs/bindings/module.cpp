#include <nanobind/nanobind.h>

#include "bindings/bindings.h"

NB_MODULE(_core, m) {
  // pydantic and typing cache the types of their fields until after the interpreter's end: not a leak of ours.
  nanobind::set_leak_warnings(false);
  m.doc() = "Compiled core of ffrobot: planar floating-frame dynamics.";
  m.attr("build") = FFROBOT_BUILD; // compiler and flags
  bind_time_function(m);
  bind_system(m);
  bind_run(m);
  bind_actuation(m);
  bind_tangent(m);
  bind_servo(m);
}
