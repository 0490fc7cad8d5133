// Actuation from an earlier analysis in joint coordinates.
#pragma once

#include "core/actuation/source.h"
#include "core/analysis/system_on_tree.h"
#include "core/integrate/recorded_motion.h"
#include "core/recursion/prescribed_motion.h"

#include <optional>

namespace ffrobot {

// Forces on the rows of a tree, told as those of its system.
class TreeSource : public ActuationSource {
public:
  OnBody on_body(std::size_t body) override;
  const Eigen::VectorXd &tau() override;
  const std::vector<Eigen::VectorXd> &modal_force() override;

protected:
  using TreeWorkspace = recursion::Workspace<recursion::Planar, double>;

  // tau and modal forces are those of the motors of `both`, which must outlive this; without any they are not known.
  explicit TreeSource(const SystemOnTree &both);

  // Of a state (q, v) of the tree: w has its kinematics and multipliers, shape_force (modes of all bodies) may be
  // empty. State and w stay as they are until the next find().
  void take(const double *state, const TreeWorkspace &w, const Eigen::VectorXd &shape_force = {});

  const SystemOnTree &both_;

private:
  void find_motors(); // unless they are known

  std::optional<recursion::Motors<recursion::Planar>> motors_;
  bool motors_are_known_ = true;
  AbsoluteState absolute_;
  Workspace workspace_;
  const double *state_ = nullptr;
  const TreeWorkspace *found_ = nullptr;
  std::vector<Eigen::VectorXd> shape_force_; // of each body
};

// From the recorded steps of a run.
class TreeActuation final : public TreeSource {
public:
  TreeActuation(const SystemOnTree &both, const Recording &recording); // both must outlive this

  double end_of_step(double t, double h) override { return recorded_.end_of_step(t, h); }

private:
  bool find(double t) override;
  void prepare(const double *times, int count) override { recorded_.foresee(times, count); }

  TreeMotion motion_; // that is made again
  RecordedMotion recorded_;
};

// Of a motion that is wholly prescribed, which must outlive this: solved anew at every time, first from the posture q
// (n_q).
class PrescribedActuation final : public TreeSource {
public:
  PrescribedActuation(const SystemOnTree &both, recursion::PrescribedMotion<recursion::Planar> &motion,
                      std::vector<recursion::ModalShape> shape, const Eigen::VectorXd &q);

private:
  bool find(double t) override;

  recursion::PrescribedMotion<recursion::Planar> &motion_;
  std::vector<recursion::ModalShape> shape_;
};

} // namespace ffrobot
