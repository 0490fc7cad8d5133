// Actuation from an earlier analysis in joint coordinates.
#pragma once

#include "core/actuation/source.h"
#include "core/analysis/prescribed_motion.h"
#include "core/integrate/recorded_motion.h"

#include <optional>

namespace ffrobot {

// Forces on the rows of a tree, told as those of its system.
class TreeSource : public ActuationSource {
public:
  OnBody on_body(std::size_t body) override;

protected:
  // tau and modal forces are those of the motors of `both`, which must outlive this; without any they are not asked
  // for.
  explicit TreeSource(const SystemOnTree &both);

  // Of a state (q, v) of the tree: w has its kinematics and multipliers, shape_force (modes of all bodies) may be
  // empty.
  void take(const double *state, const recursion::Workspace<recursion::Planar, double> &w,
            const Eigen::VectorXd &shape_force = {});

  const SystemOnTree &both_;

private:
  std::optional<MotorsOnTree> motors_;
  AbsoluteState absolute_;
  Workspace workspace_;
  Eigen::VectorXd state_;
  std::vector<Eigen::VectorXd> shape_force_; // of each body
};

// From the dense output of a recorded run.
class TreeActuation final : public TreeSource {
public:
  TreeActuation(const SystemOnTree &both, const Recording &recording); // both must outlive this

private:
  void find(double t) override;

  TreeMotion steps_, motion_; // that are made again; at the time asked for
  RecordedMotion recorded_;
  Eigen::VectorXd state_, a_;
};

// Of a motion that is wholly prescribed, which must outlive this: solved anew at every time, first from the posture q
// (n_q).
class PrescribedActuation final : public TreeSource {
public:
  PrescribedActuation(PrescribedMotion &motion, std::vector<ModalShape> shape, const Eigen::VectorXd &q);

private:
  void find(double t) override;

  PrescribedMotion &motion_;
  std::vector<ModalShape> shape_;
};

} // namespace ffrobot
