#pragma once

#include <Eigen/Core>
#include <nanobind/nanobind.h>
#include <string>

// One function per concern of the core; module.cpp calls them. Default arguments live in Python, never here.
void bind_time_function(nanobind::module_ &m);
void bind_system(nanobind::module_ &m);
void bind_run(nanobind::module_ &m);
void bind_actuation(nanobind::module_ &m);
void bind_servo(nanobind::module_ &m);
void bind_tangent(nanobind::module_ &m);

// Raises ValueError with both sizes where they differ.
inline void check_size(const char *name, Eigen::Index got, Eigen::Index expected) {
  if (got != expected)
    throw nanobind::value_error(
        (std::string(name) + ": expected size " + std::to_string(expected) + ", got " + std::to_string(got)).c_str());
}
