#pragma once

#include "core/archive.h"
#include "core/check_index.h"
#include "core/eigen.h"

#include <cstring>
#include <functional>
#include <nanobind/nanobind.h>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

// Names that all bindings use; nothing else includes this file.
namespace ffrobot::recursion {}
namespace nb = nanobind;
using namespace nb::literals;
using namespace ffrobot;
using namespace ffrobot::recursion;

// One function per folder of the core, in a file of that name; module.cpp calls them. Default arguments live in Python,
// never here: only what may be absent is None.
void bind_time_function(nb::module_ &m);
void bind_integrate(nb::module_ &m);
void bind_allocation(nb::module_ &m);
void bind_recursion(nb::module_ &m);

// The first of names that commas separate, which leaves them
inline std::string next_name(const char *&names) {
  const std::string name(names, std::strcspn(names, ","));
  names += name.size(), names += std::strspn(names, ", ");
  return name;
}

// Values of an enumeration, with their names
#define FFROBOT_VALUES(Kind, ...)                                                                                      \
  [] {                                                                                                                 \
    using enum Kind;                                                                                                   \
    return std::pair(#__VA_ARGS__, std::vector{__VA_ARGS__});                                                          \
  }()
template <class Kind> void bind_values(nb::enum_<Kind> bound, std::pair<const char *, std::vector<Kind>> values) {
  for (const Kind value : values.second)
    bound.value(next_name(values.first).c_str(), value);
}

// A record that is made empty, with all its fields (core/fields.h)
template <std::size_t i> auto &field(auto &record) {
  return record.fields([](const char *, auto &...member) -> auto & { return std::get<i>(std::tie(member...)); });
}
template <class T> void bind_fields(nb::class_<T> bound) {
  bound.def(nb::init<>());
  T().fields([&]<class... Member>(const char *names, Member &...) {
    [&]<std::size_t... i>(std::index_sequence<i...>) {
      (bound.def_prop_rw(
           next_name(names).c_str(), [](T &record) -> Member & { return field<i>(record); },
           [](T &record, const Member &value) { field<i>(record) = value; }),
       ...);
    }(std::index_sequence_for<Member...>());
  });
}

// Bytes of objects with `fields`, and objects of such bytes, which are to be those of this program.
template <class T> void bind_bytes(nb::class_<T> &bound) {
  bound.def("to_bytes", [](const T &x) {
    const std::string bytes = to_bytes(x);
    return nb::bytes(bytes.data(), bytes.size());
  });
  bound.def_static("of_bytes", [](const nb::bytes &bytes) { return of_bytes<T>({bytes.c_str(), bytes.size()}); });
}

// `call`, which has to outlive it, from where the interpreter is released: holds it meanwhile.
template <class R, class... A> auto locked(const std::function<R(A...)> &call) {
  return [&call](A... a) -> R {
    const nb::gil_scoped_acquire held;
    return call(std::forward<A>(a)...);
  };
}
