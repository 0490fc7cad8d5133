// Actuation from an earlier analysis, at any time of it.
#pragma once

#include "core/actuation/system_source.h"
#include "core/analysis/fcid.h"
#include "core/integrate/recorded_motion.h"

namespace ffrobot {

// Partially constrained: from the recording of its run.
class RecordedActuation final : public SystemSource {
public:
  RecordedActuation(const System &system, const Recording &recording, std::vector<bool> is_trajectory,
                    std::optional<ActuatorForces> actuator_forces);

private:
  const Workspace &workspace() const override { return workspace_; }
  const Eigen::VectorXd &q() const override { return q_; }
  void find(double t) override;

  const System &system_;
  ConstrainedMotion motion_;
  RecordedMotion recorded_;
  Workspace workspace_;
  Eigen::VectorXd q_, a_;
};

// Fully constrained: solved anew at every time.
class FullyConstrainedActuation final : public SystemSource {
public:
  FullyConstrainedActuation(const System &system, std::vector<ModalShape> shape, Eigen::VectorXd guess,
                            std::vector<bool> is_trajectory, std::optional<ActuatorForces> actuator_forces);

private:
  const Workspace &workspace() const override { return motion_.workspace(); }
  const Eigen::VectorXd &q() const override { return motion_.q(); }
  const std::vector<Eigen::VectorXd> &shape_force() const override { return motion_.shape_force(); }
  void find(double t) override;

  FullyConstrained motion_;
  std::vector<ModalShape> shape_;
};

} // namespace ffrobot
