#pragma once

#include <Eigen/Core>
#include <functional>
#include <nanobind/nanobind.h>
#include <string>
#include <utility>

// Names that all bindings use; nothing else includes this file.
namespace ffrobot::recursion {}
namespace nb = nanobind;
using namespace nb::literals;
using namespace ffrobot;
using namespace ffrobot::recursion;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// One function per folder of the core, in a file of that name; module.cpp calls them. Default arguments live in Python,
// never here: only what may be absent is None.
void bind_time_function(nb::module_ &m);
void bind_integrate(nb::module_ &m);
void bind_allocation(nb::module_ &m);
void bind_recursion(nb::module_ &m);

// `call`, which has to outlive it, from where the interpreter is released: holds it meanwhile.
template <class R, class... A> auto locked(const std::function<R(A...)> &call) {
  return [&call](A... a) -> R {
    const nb::gil_scoped_acquire held;
    return call(std::forward<A>(a)...);
  };
}

// Raises ValueError with both sizes where they differ.
inline void check_size(const char *name, Index got, Index expected) {
  if (got != expected)
    throw nb::value_error(
        (std::string(name) + ": expected size " + std::to_string(expected) + ", got " + std::to_string(got)).c_str());
}
