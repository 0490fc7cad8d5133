#include "core/analysis/tree_run.h"

namespace ffrobot {

Run run(TreeMotion &motion, const std::vector<double> &times, Eigen::VectorXd state,
        const IntegrationControls &controls, TreeOutputs &outputs, const std::function<bool(double)> &carry_on,
        Recording *recording, const Breaks *breaks, IntegrationCheckpoint *checkpoint) {
  Run result;
  result.report = integrate(
      motion, times, state, controls, [&](std::size_t i, double t, const double *y) { outputs(i, t, y); }, carry_on,
      recording, breaks, checkpoint);
  result.last = outputs.absolute()(state.data());
  result.outputs = outputs.take(result.report.outputs);
  return result;
}

} // namespace ffrobot
