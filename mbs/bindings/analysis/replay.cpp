#include "core/analysis/replay.h"

#include <nanobind/nanobind.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/vector.h>

#include "bindings/analysis/analysis.h"

namespace nb = nanobind;
using namespace nb::literals;
using namespace ffrobot;

void bind_replay(nb::module_ &m) {
  nb::class_<RecordedActuation, ActuationSource>(m, "RecordedActuation", "From the dense output of a recorded run.")
      .def(nb::init<const System &, const Recording &, std::vector<bool>, std::optional<ActuatorForces>>(), "system"_a,
           "recording"_a, "is_trajectory"_a, "actuator_forces"_a.none(), nb::keep_alive<1, 2>(),
           nb::keep_alive<1, 3>());
}
