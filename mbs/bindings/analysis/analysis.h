// Pieces of bind_analysis.
#pragma once

#include <nanobind/nanobind.h>

void bind_run(nanobind::module_ &m);     // what motions report
void bind_sensing(nanobind::module_ &m); // what is read of them
