// What an earlier analysis found, at any time of it.
#pragma once

#include "core/time_function/time_function.h"

#include "core/eigen.h"

#include <limits>
#include <memory>
#include <utility>

namespace ffrobot {

// Forces and voltages, number by number.
class ForceSource {
public:
  explicit ForceSource(Index count) : values_(VectorXd::Zero(count)) {}
  virtual ~ForceSource() = default;

  const VectorXd &values() const { return values_; } // (count) of the last evaluate()

  // Values are those of time t afterwards. Costs nothing where they are already: stages of a step and outputs meet.
  void evaluate(double t) {
    if (t != time_)
      time_ = find(t) ? t : nowhere;
  }

  // As OdeSystem has them: the next times will be the stages of a step, and where one had best end.
  void set_stage_times(const double *times, int count) {
    time_ = nowhere;
    prepare(times, count);
  }
  virtual double end_of_step(double t, double h) { return t + h; }

protected:
  // Fills values_; false where they are those of a stage of a step, not of time t at any other moment.
  virtual bool find(double t) = 0;
  virtual void prepare(const double *, int) {}

  VectorXd values_;

private:
  static constexpr double nowhere = std::numeric_limits<double>::quiet_NaN();
  double time_ = nowhere;
};

class ForcesOfTime final : public ForceSource {
public:
  explicit ForcesOfTime(std::vector<TimeFunction> functions)
      : ForceSource(functions.size()), functions_(std::move(functions)) {}

private:
  bool find(double t) override {
    for (std::size_t i = 0; i < functions_.size(); ++i)
      values_[i] = functions_[i](t).value;
    return true;
  }

  std::vector<TimeFunction> functions_;
};

// The numbers of one source, then those of another, which says nothing about steps.
class ForcesOfBoth final : public ForceSource {
public:
  ForcesOfBoth(std::shared_ptr<ForceSource> first, std::shared_ptr<ForceSource> second)
      : ForceSource(first->values().size() + second->values().size()), first_(std::move(first)),
        second_(std::move(second)) {}

  double end_of_step(double t, double h) override { return first_->end_of_step(t, h); }

private:
  bool find(double t) override {
    first_->evaluate(t), second_->evaluate(t);
    values_ << first_->values(), second_->values();
    return false; // they know themselves where they are
  }
  void prepare(const double *times, int count) override { first_->set_stage_times(times, count); }

  std::shared_ptr<ForceSource> first_, second_;
};

} // namespace ffrobot
