// Forces that an inverse analysis found, at any time of it: of a recorded run stage by stage for another one with the
// same steps, of a prescribed motion solved anew.
#pragma once

#include "core/analysis/allocation.h"
#include "core/analysis/force_source.h"
#include "core/integrate/recorded_motion.h"
#include "core/recursion/inverse/prescribed_motion.h"

namespace ffrobot::recursion {

// What is read of a state.
template <class Space> class ForceReader {
public:
  virtual ~ForceReader() = default;
  virtual Index count() const = 0;
  // Of q (n_q), with the kinematics and multipliers of w: writes (count) numbers. `shape` (n_v): forces that hold
  // prescribed modes, zero along joints; null: none.
  virtual void read(const double *q, const Workspace<Space, double> &w, const VectorXd *shape, double *to) = 0;
};

// The recorded run made again. Mechanism, scene and recording must outlive this.
template <class Space> class RecordedForces final : public ForceSource {
public:
  RecordedForces(const Mechanism<Space> &mechanism, const Scene &scene, const Recording &recording,
                 std::shared_ptr<ForceReader<Space>> reader);

  double end_of_step(double t, double h) override { return recorded_.end_of_step(t, h); }

private:
  bool find(double t) override;
  void prepare(const double *times, int count) override { recorded_.set_stage_times(times, count); }

  RecursiveMotion<Space> motion_;
  RecordedMotion recorded_;
  std::shared_ptr<ForceReader<Space>> reader_;
};

// The motion, which must outlive this, is solved anew at every time, first from the posture q (n_q).
template <class Space> class PrescribedForces final : public ForceSource {
public:
  PrescribedForces(PrescribedMotion<Space> &motion, std::vector<ModalShape> shape, const VectorXd &q,
                   std::shared_ptr<ForceReader<Space>> reader);

private:
  bool find(double t) override;

  PrescribedMotion<Space> &motion_;
  std::vector<ModalShape> shape_;
  VectorXd holding_; // (n_v)
  std::shared_ptr<ForceReader<Space>> reader_;
};

// The patches of one link: voltages for modal forces on `modes` of its body from v[first] on, of which they reach
// `reached` (reached, modes).
struct LinkPatches {
  int first;
  MatrixXd reached;
  Allocation allocation;
};

// Forces of motors (N m or N) within their limits, then voltages of patches for the modal forces that are left.
template <class Space> class ActuatorReader final : public ForceReader<Space> {
public:
  ActuatorReader(DrivenMechanism<Space> driven, VectorXd limit, std::vector<LinkPatches> patches);

  Index count() const override;
  void read(const double *q, const Workspace<Space, double> &w, const VectorXd *shape, double *to) override;

private:
  DrivenMechanism<Space> driven_;
  Motors<Space> motors_;
  VectorXd limit_;
  std::vector<LinkPatches> patches_;
  VectorXd modal_, reached_; // (n_v) for patches; what those of a link reach of it
};

// Forces -lambda of constraint equations: along joint coordinates as they are, and of others the force and the moment
// about the section where they act, global axes.
template <class Space> class PathReader final : public ForceReader<Space> {
public:
  struct Part {
    int row, column; // of multipliers; the first of what is read
    double sign;     // of a coordinate; on section b 1, on section a -1
  };
  // axes (3, 3): columns are the axes of the mechanism, global axes
  PathReader(const Mechanism<Space> &mechanism, Matrix3d axes, std::vector<Part> parts, Index count)
      : mechanism_(mechanism), axes_(std::move(axes)), parts_(std::move(parts)), count_(count) {}

  Index count() const override { return count_; }
  void read(const double *q, const Workspace<Space, double> &w, const VectorXd *shape, double *to) override;

private:
  const Mechanism<Space> &mechanism_;
  Matrix3d axes_;
  std::vector<Part> parts_;
  Index count_;
};

// Components of force at points of one body, along axes of its frame: as close to L_a F_a = Q_a (Shabana 2022, Eqs. 9
// and 10) as they get, the rows of which `scale` (6 + n) makes comparable. A column of L_a, of a unit force along e at
// u = x + Phi p: [e; u x e; Phi^T e].
struct PointComponents {
  int node;
  Matrix3d axes;                        // of the body's data, in axes of the frame: columns
  Vector3d origin;                      // likewise
  Eigen::Matrix3Xd direction, position; // (3, c) e and x
  MatrixXd Phi;                         // (3 c, n)
  VectorXd scale;
};

// Forces of a path as forces at points, global axes: (3) of each component.
class PointReader final : public ForceReader<Spatial> {
public:
  PointReader(const DrivenMechanism<Spatial> &driven, std::vector<PointComponents> bodies)
      : mechanism_(driven.mechanism), path_(driven), bodies_(std::move(bodies)) {}

  Index count() const override;
  void read(const double *q, const Workspace<Spatial, double> &w, const VectorXd *shape, double *to) override;

private:
  const Mechanism<Spatial> &mechanism_;
  Motors<Spatial> path_;
  std::vector<PointComponents> bodies_;
};

} // namespace ffrobot::recursion
