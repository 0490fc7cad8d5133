// A whole analysis: integrates the motion and evaluates what is reported at the output times.
#pragma once

#include "core/actuation/actuation.h"
#include "core/integrate/integrate.h"
#include "core/system/motion.h"

#include <functional>
#include <vector>

namespace ffrobot {

using RowMajorMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// One row per output time that was reached.
struct Outputs {
  RowMajorMatrix q, v, a, lambda; // (T, coordinates) and (T, constraints)
  RowMajorMatrix tau, F_p;        // (T, motors) and (T, modes of all bodies); empty without a resolver
  RowMajorMatrix residual;        // (T, 3) of C, C_dot, C_ddot: relative to the size of their terms
};

struct Run {
  IntegrationReport report;
  Outputs outputs;
  Eigen::VectorXd last; // (q, q_dot) at report.time
};

// Integrates `motion` from (q, v) over `times`. `resolver`, `recording` and `checkpoint` may be null. Where the run
// goes on from a `checkpoint`, rows of outputs that were delivered before are left as they are: undefined.
Run run(ConstrainedMotion &motion, const std::vector<double> &times, const Eigen::VectorXd &q, const Eigen::VectorXd &v,
        const IntegrationControls &controls, ExternalLoads *steering, ActuatorForces *resolver,
        const std::function<bool(double)> &carry_on, Recording *recording, Checkpoint *checkpoint);

// Evaluates the reported quantities of one state into row i of `outputs` (already sized).
class OutputEvaluator {
public:
  OutputEvaluator(const System &system, std::size_t count, ExternalLoads *steering, ActuatorForces *resolver);

  void operator()(std::size_t i, double t, const double *y);
  Outputs take(std::size_t reached);

private:
  const System &system_;
  Workspace workspace_;
  ExternalLoads *steering_;
  ActuatorForces *resolver_;
  Eigen::VectorXd y_, a_, value_, rate_;
  Outputs outputs_;
};

} // namespace ffrobot
