// Where a run has stopped, as bytes: what the next step depends on, and what the run has kept.
#pragma once

#include "bindings/bindings.h"
#include "core/archive.h"
#include "core/integrate/integrate.h"

#include <string>

namespace ffrobot {

// Bytes of objects with `fields`, and objects of such bytes, which are to be those of this program.
template <class T> void bind_bytes(nb::class_<T> &bound) {
  bound.def("to_bytes", [](const T &x) {
    const std::string bytes = to_bytes(x);
    return nb::bytes(bytes.data(), bytes.size());
  });
  bound.def_static("of_bytes", [](const nb::bytes &bytes) { return of_bytes<T>({bytes.c_str(), bytes.size()}); });
}

} // namespace ffrobot
