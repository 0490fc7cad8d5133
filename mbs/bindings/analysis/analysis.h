// Pieces of bind_analysis.
#pragma once

#include <nanobind/nanobind.h>

void bind_run(nanobind::module_ &m);     // integrated motions
void bind_sampled(nanobind::module_ &m); // under a sampled controller
void bind_replay(nanobind::module_ &m);  // algebraic ones, and sources of actuation
