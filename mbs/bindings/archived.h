// Where a run has stopped, as bytes: what the next step depends on, and what the run has kept.
#pragma once

#include "bindings/bindings.h"
#include "core/archive.h"
#include "core/integrate/integrate.h"

#include <string>

namespace ffrobot {

template <class Archive> void fields(Archive &a, StepHistory &x) {
  archived_all(a, x.next_step, x.usual_step, x.reserve, x.previous_step, x.previous_error, x.in_transient,
               x.without_look);
}
template <class Archive> void fields(Archive &a, MethodHistory &x) {
  archived_all(a, x.second, x.pace_of_other, x.since, x.measured, x.tries, x.window, x.trial);
}
template <class Archive> void fields(Archive &a, IntegrationCheckpoint &x) {
  archived_all(a, x.time, x.state, x.steps, x.outputs, x.methods);
}
template <class Archive> void fields(Archive &a, RangeSeen &x) { archived_all(a, x.least, x.largest, x.left_at); }
template <class Archive> void fields(Archive &a, MethodChoice &x) { archived_all(a, x.kind, x.spectral_radius); }
template <class Archive> void fields(Archive &a, Recording &x) {
  archived_all(a, x.times, x.states, x.tolerance, x.methods);
}
template <class Archive> void fields(Archive &a, Samples &x) {
  archived_all(a, x.longest, x.most, x.parts, x.times, x.states, x.steps, x.every);
}

// Bytes of objects with `fields`, and objects of such bytes, which are to be those of this program.
template <class T> void bind_bytes(nb::class_<T> &bound) {
  bound.def("to_bytes", [](const T &x) {
    const std::string bytes = to_bytes(x);
    return nb::bytes(bytes.data(), bytes.size());
  });
  bound.def_static("of_bytes", [](const nb::bytes &bytes) { return of_bytes<T>({bytes.c_str(), bytes.size()}); });
}

} // namespace ffrobot
