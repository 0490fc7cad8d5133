// Actuation from an earlier analysis, from its dense output: samples at fixed times would alias the fast modes.
#pragma once

#include "core/actuation.h"
#include "core/integrate.h"
#include "core/method.h"
#include "core/motion.h"

#include <array>

namespace ffrobot {

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

// How the recorded actuation enters the forward run.
enum class AppliedActuation {
  trajectory,        // the forces -lambda_s on their points: one drive per trajectory constraint
  joints,            // the motor forces tau: one drive per motor
  joints_and_patches // and the modal forces F_p, as far as the patches can produce them
};

class ReplayedActuation final : public Steering {
public:
  // projector[b]: (n, n) what the patches of body b make of the wanted F_p; empty where it has no patches.
  ReplayedActuation(const System &inverse, const Recording &recording, ActuationResolver resolver,
                    std::vector<bool> trajectory, AppliedActuation applied, std::vector<Eigen::MatrixXd> projector);

  void steer(double t, Workspace &forward) override;

private:
  const System &inverse_;
  RecordedMotion motion_;
  ActuationResolver resolver_;
  Workspace workspace_;
  std::vector<bool> trajectory_;
  AppliedActuation applied_;
  std::vector<Eigen::MatrixXd> projector_;
  Eigen::VectorXd y_, a_;
};

} // namespace ffrobot
