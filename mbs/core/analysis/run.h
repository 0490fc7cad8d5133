// A whole analysis: integrates the motion and evaluates what is reported at the output times.
#pragma once

#include "core/actuation/actuator_forces.h"
#include "core/integrate/integrate.h"
#include "core/system/motion.h"

#include <functional>
#include <vector>

namespace ffrobot {

using RowMajorMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// One row per output time that was reached.
struct Outputs {
  RowMajorMatrix q, v, a;     // (T, n_q), (T, n_v), (T, n_v)
  RowMajorMatrix lambda;      // (T, constraints, then rotors)
  RowMajorMatrix tau, F_p;    // (T, motors) and (T, modes of all bodies); empty without actuator forces
  RowMajorMatrix shape_force; // (T, modes of all bodies) -lambda_p; empty where no shape is prescribed
  RowMajorMatrix residual;    // (T, 3) of C, C_dot, C_ddot: relative to the size of their terms
};

// Where a run has stopped.
struct Checkpoint {
  IntegrationCheckpoint integration;
  Peaks peaks; // that errors are compared with
};

struct Run {
  IntegrationReport report;
  Outputs outputs;
  Eigen::VectorXd last; // (q, v) at report.time
};

// Evaluates the reported quantities of one state into row i of `outputs` (already sized).
class OutputEvaluator {
public:
  // external_loads and actuator_forces may be null.
  OutputEvaluator(const System &system, std::size_t count, ExternalLoads *external_loads,
                  ActuatorForces *actuator_forces);

  void operator()(std::size_t i, double t, const double *y);
  Outputs take(std::size_t reached);

private:
  const System &system_;
  Workspace workspace_;
  ExternalLoads *external_loads_;
  ActuatorForces *actuator_forces_;
  Eigen::VectorXd q_, v_, a_, value_, rate_;
  Outputs outputs_;
};

// Integrates `motion` from (q, v) over `times`. `recording` and `checkpoint` may be null. Where the run goes on from a
// `checkpoint`, rows of outputs that were delivered before are left as they are: undefined.
// Throws std::invalid_argument where the checkpoint is not one of this system.
Run run(ConstrainedMotion &motion, const std::vector<double> &times, const Eigen::VectorXd &q, const Eigen::VectorXd &v,
        const IntegrationControls &controls, OutputEvaluator evaluate, const std::function<bool(double)> &carry_on,
        Recording *recording, Checkpoint *checkpoint);

} // namespace ffrobot
