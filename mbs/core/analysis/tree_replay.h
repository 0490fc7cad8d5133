// Actuation from an earlier analysis that was integrated in joint coordinates.
#pragma once

#include "core/actuation/source.h"
#include "core/analysis/motors_on_tree.h"
#include "core/integrate/recorded_motion.h"

#include <optional>

namespace ffrobot {

class TreeActuation final : public ActuationSource {
public:
  // tau and modal forces are those of the motors of `both`; without any they are not asked for. Both must outlive this.
  TreeActuation(const SystemOnTree &both, const Recording &recording);

  OnBody on_body(std::size_t body) override;

private:
  void find(double t) override;

  const SystemOnTree &both_;
  TreeMotion steps_, motion_; // that are made again; at the time asked for
  RecordedMotion recorded_;
  std::optional<MotorsOnTree> motors_;
  AbsoluteState absolute_;
  Workspace workspace_;
  Eigen::VectorXd state_, a_;
};

} // namespace ffrobot
