// Members of records, named once for all who go over them: bytes (archive.h) and attributes in Python (bindings.h).
#pragma once

// In a record: calls visit("a, b", a, b) with the members that are given.
#define FFROBOT_FIELDS(...)                                                                                            \
  template <class Visit> decltype(auto) fields(Visit &&visit) { return visit(#__VA_ARGS__, __VA_ARGS__); }
