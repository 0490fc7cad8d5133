// What acts on the robot in a forward run: each actuator takes its orders from an inverse analysis.
#pragma once

#include "core/actuation/allocation.h"
#include "core/actuation/external_loads.h"
#include "core/actuation/points.h"
#include "core/actuation/source.h"

#include <memory>
#include <optional>
#include <vector>

namespace ffrobot {

// Turns the findings of an inverse analysis, evaluated for the time in question, into loads on the forward system:
// sets drives (from `first_drive` of the actuator on) or modal forces.
class Actuator {
public:
  virtual ~Actuator() = default;
  virtual void act(ActuationSource &source, ExternalForces &forward) = 0;
};

// The forces -lambda_s on their points: one drive per trajectory constraint.
class TrajectoryForces final : public Actuator {
public:
  explicit TrajectoryForces(std::size_t first_drive) : first_drive_(first_drive) {}
  void act(ActuationSource &source, ExternalForces &forward) override;

private:
  std::size_t first_drive_;
};

// The motor forces tau, each cut at its limit: one drive per motor.
class Motors final : public Actuator {
public:
  Motors(std::size_t first_drive, Eigen::VectorXd limit) : first_drive_(first_drive), limit_(std::move(limit)) {}
  void act(ActuationSource &source, ExternalForces &forward) override;

private:
  std::size_t first_drive_;
  Eigen::VectorXd limit_;
};

// The modal forces of one link, as far as its patches can produce them within their limits. The link is one body, or in
// pieces: the bodies from `body` on whose modes the allocation has, side by side.
class Patches final : public Actuator {
public:
  Patches(std::size_t body, Allocation allocation)
      : body_(body), allocation_(std::move(allocation)), force_(allocation_.Phi().rows()) {}
  void act(ActuationSource &source, ExternalForces &forward) override;

private:
  std::size_t body_;
  Allocation allocation_;
  Eigen::VectorXd force_;
};

// Q_a of one body as forces at its actuation points: two drives (global x and y) per component.
class PointForces final : public Actuator {
public:
  PointForces(std::size_t first_drive, std::size_t body, ActuationPoints points)
      : first_drive_(first_drive), body_(body), points_(std::move(points)) {}
  void act(ActuationSource &source, ExternalForces &forward) override;

private:
  std::size_t first_drive_, body_;
  ActuationPoints points_;
};

class Actuation final : public ExternalLoads {
public:
  Actuation(std::shared_ptr<ActuationSource> source, std::vector<std::shared_ptr<Actuator>> actuators)
      : source_(std::move(source)), actuators_(std::move(actuators)) {}

  void apply(double t, ExternalForces &forward) override;
  void foresee(const double *times, int count) override { source_->foresee(times, count); }
  double end_of_step(double t, double h) override { return source_->end_of_step(t, h); }

private:
  std::shared_ptr<ActuationSource> source_;
  std::vector<std::shared_ptr<Actuator>> actuators_;
};

} // namespace ffrobot
