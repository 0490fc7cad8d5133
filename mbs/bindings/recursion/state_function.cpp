// Forces of the user's, of how points move: mbs/core/recursion/constrained_aba/point_force.h.

#include <nanobind/stl/function.h>
#include <nanobind/stl/vector.h>

#include "bindings/recursion/recursion.h"

namespace {

using Numbers = std::vector<double>;
using PythonForce = std::function<Numbers(double, const Numbers &, const Numbers &)>;

// `python` takes position and velocity (2 or 3 numbers), and returns force and moment (3 or 6).
StateFunction python_force(const PythonForce &python, bool is_planar) {
  const int n = is_planar ? 2 : 3;
  return {[python, n](double t, const double *position, const double *rate, double *force) {
            const Numbers found = python(t, {position, position + n}, {rate, rate + n});
            check_size("force and moment", found.size(), 3 * n - 3);
            std::copy(found.begin(), found.end(), force);
          },
          is_planar};
}

StateFunction compiled_force(std::uintptr_t address, bool is_planar) {
  return {reinterpret_cast<StateFunction::Compiled>(address), is_planar};
}

Numbers called(const StateFunction &function, double t, const Numbers &position, const Numbers &rate) {
  check_size("position", position.size(), function.is_planar ? 3 : 12);
  check_size("rates", rate.size(), function.is_planar ? 3 : 6);
  Numbers force(rate.size());
  function.call(t, position.data(), rate.data(), force.data());
  return force;
}

} // namespace

void bind_state_function(nb::module_ &m) {
  nb::class_<StateFunction>(m, "StateFunction",
                            "A force of the user's; see mbs/core/recursion/constrained_aba/point_force.h.")
      .def("__call__", &called, "t"_a, "position"_a, "rate"_a, "Force and moment: N, N m.")
      .def_ro("is_planar", &StateFunction::is_planar)
      .def_static("python", &python_force, "function"_a, "is_planar"_a,
                  "A callable of t, position and velocity that returns force and moment.")
      .def_static(
          "compiled", &compiled_force, "address"_a, "is_planar"_a,
          "Address of a C function void(double t, const double *position, const double *rates, double *force).");
}
