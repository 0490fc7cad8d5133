#pragma once

#include <nanobind/nanobind.h>

// One function per concern of the core; module.cpp calls them. Default arguments live in Python, never here.
void bind_time_function(nanobind::module_ &m);
void bind_system(nanobind::module_ &m);
void bind_run(nanobind::module_ &m);
void bind_actuation(nanobind::module_ &m);
void bind_servo(nanobind::module_ &m);
