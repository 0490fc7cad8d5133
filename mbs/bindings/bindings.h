#pragma once

#include <Eigen/Core>
#include <functional>
#include <nanobind/nanobind.h>
#include <string>
#include <utility>

// One function per folder of the core, in a file of that name; module.cpp calls them. Default arguments live in Python,
// never here: only what may be absent is None.
void bind_time_function(nanobind::module_ &m);
void bind_integrate(nanobind::module_ &m);
void bind_allocation(nanobind::module_ &m);
void bind_recursion(nanobind::module_ &m);

// `call`, which has to outlive it, from where the interpreter is released: holds it meanwhile.
template <class R, class... A> auto locked(const std::function<R(A...)> &call) {
  return [&call](A... a) -> R {
    const nanobind::gil_scoped_acquire held;
    return call(std::forward<A>(a)...);
  };
}

// Raises ValueError with both sizes where they differ.
inline void check_size(const char *name, Eigen::Index got, Eigen::Index expected) {
  if (got != expected)
    throw nanobind::value_error(
        (std::string(name) + ": expected size " + std::to_string(expected) + ", got " + std::to_string(got)).c_str());
}
