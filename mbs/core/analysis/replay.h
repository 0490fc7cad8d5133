// Actuation from an earlier analysis, from its dense output: samples at fixed times would alias the fast modes.
#pragma once

#include "core/actuation/source.h"
#include "core/analysis/fcid.h"
#include "core/integrate/integrate.h"
#include "core/integrate/method.h"
#include "core/system/motion.h"

#include <limits>
#include <optional>

namespace ffrobot {

// The state of a recorded run at any time, by making the step around it again.
class RecordedMotion {
public:
  RecordedMotion(const System &system, const Recording &recording);

  const double *state(double t); // (q, v); valid until the next call

private:
  struct Interval { // between two recorded states
    std::size_t index = static_cast<std::size_t>(-1);
    MethodKind kind = MethodKind::dop853;
    std::unique_ptr<Method> method;
    bool is_step = true; // else iterations did not converge
    double begin = 0, length = 0;
    Eigen::VectorXd start;
  };

  const double *recorded(std::size_t i) const; // state i
  void find_interval(double t);                // that of hint_
  void make_again(Interval &interval);         // the step of the interval, by the method that made it
  bool step_again(Method &method, double t0, double h);
  void between_ends(const Interval &interval, double t); // into z_

  ConstrainedMotion motion_;
  const Recording &recording_;
  std::size_t hint_ = 0;
  std::vector<Interval> cache_; // the stages of a step visit a few recorded steps in turn
  std::size_t next_ = 0;
  Eigen::VectorXd z_;
};

// Partially constrained: from the recording of its run.
class RecordedActuation final : public ActuationSource {
public:
  RecordedActuation(const System &system, const Recording &recording, std::vector<bool> is_trajectory,
                    std::optional<ActuatorForces> actuator_forces);

  const System &system() const override { return system_; }
  const Workspace &workspace() const override { return workspace_; }
  const Eigen::VectorXd &q() const override { return q_; }

private:
  void find(double t) override;

  const System &system_;
  RecordedMotion motion_;
  Workspace workspace_;
  Eigen::VectorXd q_, a_;
};

// Fully constrained: solved anew at every time.
class FullyConstrainedActuation final : public ActuationSource {
public:
  FullyConstrainedActuation(const System &system, std::vector<ModalShape> shape, Eigen::VectorXd guess,
                            std::vector<bool> is_trajectory, std::optional<ActuatorForces> actuator_forces);

  const System &system() const override { return system_; }
  const Workspace &workspace() const override { return motion_.workspace(); }
  const Eigen::VectorXd &q() const override { return motion_.q(); }
  const std::vector<Eigen::VectorXd> &shape_force() const override { return motion_.shape_force(); }

private:
  void find(double t) override;

  const System &system_;
  FullyConstrained motion_;
  std::vector<ModalShape> shape_;
};

} // namespace ffrobot
