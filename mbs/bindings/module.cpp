#include "bindings/bindings.h"

NB_MODULE(_core, m) {
  // pydantic and typing keep the types of their fields until after the interpreter has ended, which nanobind would
  // report as a leak.
  nb::set_leak_warnings(false);
  m.doc() = "Compiled core of ffrobot: floating-frame dynamics in joint coordinates, in the plane and in space.";
  m.attr("build") = FFROBOT_BUILD; // compiler and flags
  bind_time_function(m);
  bind_integrate(m);
  bind_allocation(m);
  bind_recursion(m);
}
