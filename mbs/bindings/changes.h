// Changes of integrators during a run, as Python sees them.
#pragma once

#include "core/integrate/integrate.h"

#include <tuple>
#include <vector>

// (time, from, to, mean step before) of each
inline auto changes_of(const ffrobot::IntegrationReport &report) {
  std::vector<std::tuple<double, ffrobot::MethodKind, ffrobot::MethodKind, double>> changes;
  for (const ffrobot::MethodChange &change : report.changes)
    changes.emplace_back(change.time, change.from, change.to, change.mean_step);
  return changes;
}
