// Pieces of bind_system.
#pragma once

#include "core/system/system.h"

#include <nanobind/nanobind.h>

void bind_parts(nanobind::class_<ffrobot::System> &system);       // bodies, constraints, loads
void bind_evaluations(nanobind::class_<ffrobot::System> &system); // what is computed of a state
