// Actuation from an earlier analysis, from its dense output: samples at fixed times would alias the fast modes.
#pragma once

#include "core/actuation/actuation.h"
#include "core/analysis/fcid.h"
#include "core/integrate/integrate.h"
#include "core/integrate/method.h"
#include "core/system/motion.h"

#include <limits>
#include <optional>

namespace ffrobot {

// What an inverse analysis found, at any time of it.
class ActuationSource {
public:
  virtual ~ActuationSource() = default;

  // Everything below is that of time t afterwards. Costs nothing where it is already: stages of a step and outputs
  // meet.
  void evaluate(double t) {
    if (t != time_)
      find(t);
    time_ = t;
  }

  virtual const System &system() const = 0;
  virtual const Workspace &workspace() const = 0; // kinematics, multipliers
  virtual const Eigen::VectorXd &q() const = 0;
  const Eigen::VectorXd &tau() const { return tau_; }                                     // (motors)
  const std::vector<Eigen::VectorXd> &modal_force() const { return modal_force_; }        // F_p of each body
  virtual const std::vector<Eigen::VectorXd> &shape_force() const { return modal_zero_; } // -lambda_p of each body
  bool is_trajectory(std::size_t constraint) const { return is_trajectory_[constraint]; }

protected:
  // resolver: empty where the motors do not fit the mechanism; then neither tau nor modal forces are asked for.
  ActuationSource(const System &system, std::vector<bool> is_trajectory, std::optional<ActuatorForces> resolver);

  virtual void find(double t) = 0;
  void resolve(); // tau and F_p from the workspace

private:
  double time_ = std::numeric_limits<double>::quiet_NaN();
  std::vector<bool> is_trajectory_;
  std::optional<ActuatorForces> resolver_;
  Eigen::VectorXd tau_;
  std::vector<Eigen::VectorXd> modal_force_, modal_zero_;
};

// The state of a recorded run at any time, by making the step around it again.
class RecordedMotion {
public:
  RecordedMotion(const System &system, const Recording &recording);

  void state(double t, double *y);

private:
  struct Interval {
    std::size_t index = static_cast<std::size_t>(-1);
    std::unique_ptr<Method> method;
  };

  ConstrainedMotion motion_;
  const Recording &recording_;
  std::size_t hint_ = 0;
  std::vector<Interval> cache_; // the stages of a step visit a few recorded steps in turn
  std::size_t next_ = 0;
};

// Partially constrained: from the recording of its run.
class RecordedActuation final : public ActuationSource {
public:
  RecordedActuation(const System &system, const Recording &recording, std::vector<bool> is_trajectory,
                    std::optional<ActuatorForces> resolver);

  const System &system() const override { return system_; }
  const Workspace &workspace() const override { return workspace_; }
  const Eigen::VectorXd &q() const override { return q_; }

private:
  void find(double t) override;

  const System &system_;
  RecordedMotion motion_;
  Workspace workspace_;
  Eigen::VectorXd y_, q_, a_;
};

// Fully constrained: solved anew at every time.
class FullyConstrainedActuation final : public ActuationSource {
public:
  FullyConstrainedActuation(const System &system, std::vector<ModalShape> shape, Eigen::VectorXd guess,
                            std::vector<bool> is_trajectory, std::optional<ActuatorForces> resolver);

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
