// Forces of a source in another run: along its coordinates, and at points of its bodies.
#pragma once

#include "core/analysis/force_source.h"
#include "core/recursion/motion/motion.h"

namespace ffrobot::recursion {

class Replay final : public ExternalForces {
public:
  struct AtPoint {
    Index number; // of the source's
    Index entry;  // in wrenches
    double share;
  };
  // `along`: what units of all numbers of the source do along v.
  Replay(std::shared_ptr<ForceSource> source, ZeroOrderHold along, std::vector<AtPoint> at_points)
      : source_(std::move(source)), along_(std::move(along)), at_points_(std::move(at_points)) {}

  void add(double t, const double *q, double *force, double *wrench) override {
    source_->evaluate(t);
    along_.hold(source_->values());
    along_.add(q, force);
    for (const auto &[number, entry, share] : at_points_)
      wrench[entry] += share * source_->values()[number];
  }
  void set_stage_times(const double *times, int count) override { source_->set_stage_times(times, count); }
  double end_of_step(double t, double h) override { return source_->end_of_step(t, h); }

  const ForceSource &source() const { return *source_; }
  const ZeroOrderHold &along() const { return along_; }
  const std::vector<AtPoint> &at_points() const { return at_points_; }

private:
  std::shared_ptr<ForceSource> source_;
  ZeroOrderHold along_;
  std::vector<AtPoint> at_points_;
};

} // namespace ffrobot::recursion
