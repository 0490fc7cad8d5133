// A whole analysis of a planar system that is integrated in joint coordinates, and reported in the system's own.
#pragma once

#include "core/analysis/sampled.h"
#include "core/analysis/tree_outputs.h"

namespace ffrobot {

// Integrates `motion` from `state` over `times`. State, recording and checkpoint are of the tree; `recording`,
// `breaks`, `checkpoint` and `samples`, which are of the tree, too, may be null. Where the run goes on from a
// checkpoint, rows of outputs that were delivered before are left as they are: undefined.
Run run(TreeMotion &motion, const std::vector<double> &times, Eigen::VectorXd state,
        const IntegrationControls &controls, TreeOutputs &outputs, const std::function<bool(double)> &carry_on,
        Recording *recording, const Breaks *breaks, IntegrationCheckpoint *checkpoint, Samples *samples = nullptr);

// The same under a sampled controller; `commands` are the external loads of `motion` and `outputs`.
Run run_sampled(TreeMotion &motion, const std::vector<double> &times, Eigen::VectorXd state,
                const IntegrationControls &controls, TreeOutputs &outputs, HeldCommands &commands, Sensing &sensing,
                const Sampling &sampling, const std::function<bool(double)> &carry_on, Samples *samples = nullptr);

} // namespace ffrobot
