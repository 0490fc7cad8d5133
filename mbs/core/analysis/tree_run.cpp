#include "core/analysis/tree_run.h"

namespace ffrobot {

Run run(TreeMotion &motion, const std::vector<double> &times, Eigen::VectorXd state,
        const IntegrationControls &controls, TreeOutputs &outputs, const std::function<bool(double)> &carry_on,
        Recording *recording, const Breaks *breaks, IntegrationCheckpoint *checkpoint, Samples *samples) {
  Run result;
  motion.plan(times.back() - times.front());
  result.report = integrate(
      motion, times, state, controls, [&](std::size_t i, double t, const double *y) { outputs(i, t, y); }, carry_on,
      recording, breaks, checkpoint, nullptr, samples);
  result.last = outputs.absolute()(state.data());
  result.outputs = outputs.take(result.report.outputs);
  return result;
}

Run run_sampled(TreeMotion &motion, const std::vector<double> &times, Eigen::VectorXd state,
                const IntegrationControls &controls, TreeOutputs &outputs, HeldCommands &commands, Sensing &sensing,
                const Sampling &sampling, const std::function<bool(double)> &carry_on, Samples *samples) {
  HeldPlant plant(commands, sensing, [&](double t, const double *y) -> HeldPlant::Observed {
    const double *a = sensing.needs_accelerations() ? outputs.accelerations(t, y).data() : nullptr;
    const Eigen::VectorXd &absolute = outputs.absolute()(y);
    return {absolute.data(), absolute.data() + outputs.absolute().coordinates(), a};
  });
  const SampledLoop loop(plant, sampling, times.back());
  return run(motion, times, std::move(state), controls, outputs, carry_on, nullptr, &loop.breaks(), nullptr, samples);
}

} // namespace ffrobot
