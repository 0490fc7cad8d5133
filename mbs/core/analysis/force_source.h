// What an earlier analysis found, at any time of it.
#pragma once

#include "core/time_function/time_function.h"

#include <Eigen/Core>

#include <limits>
#include <memory>
#include <utility>
#include <vector>

namespace ffrobot {

// Forces and voltages, number by number.
class ForceSource {
public:
  explicit ForceSource(Eigen::Index count) : values_(Eigen::VectorXd::Zero(count)) {}
  virtual ~ForceSource() = default;

  // Costs nothing where t is that of the call before: stages of a step and outputs meet.
  void evaluate(double t) {
    if (t == time_)
      return;
    find(t);
    time_ = t;
  }
  const Eigen::VectorXd &values() const { return values_; } // (count) of the last evaluate()

protected:
  virtual void find(double t) = 0;
  Eigen::VectorXd values_; // filled by find()

private:
  double time_ = std::numeric_limits<double>::quiet_NaN();
};

class ForcesOfTime final : public ForceSource {
public:
  explicit ForcesOfTime(std::vector<TimeFunction> functions)
      : ForceSource(static_cast<Eigen::Index>(functions.size())), functions_(std::move(functions)) {}

private:
  void find(double t) override {
    for (std::size_t i = 0; i < functions_.size(); ++i)
      values_[static_cast<Eigen::Index>(i)] = functions_[i](t).value;
  }

  std::vector<TimeFunction> functions_;
};

// The numbers of one source, then those of another.
class ForcesOfBoth final : public ForceSource {
public:
  ForcesOfBoth(std::shared_ptr<ForceSource> first, std::shared_ptr<ForceSource> second)
      : ForceSource(first->values().size() + second->values().size()), first_(std::move(first)),
        second_(std::move(second)) {}

private:
  void find(double t) override {
    first_->evaluate(t), second_->evaluate(t);
    values_ << first_->values(), second_->values();
  }

  std::shared_ptr<ForceSource> first_, second_;
};

} // namespace ffrobot
