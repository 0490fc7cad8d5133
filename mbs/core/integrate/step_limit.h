// How long steps may be where functions of time bend: error estimates see them only at the stages of a step, and where
// nothing moves a step can be longer than a load takes to come and go.
#pragma once

#include "core/integrate/ode.h"

#include <cmath>
#include <numeric>

namespace ffrobot {

// With the functions f(t) that the system is prescribed, relative to their range, a step h from t is to keep
//
//   h * integral of |f''| from t to t + h  <=  4,
//
// for each: half a period of a sine, a third of a hump, to a sample before what jumps. The integral is that of a
// thousand samples of the run: what comes and goes between two of them is not seen, and no step is made shorter than
// some of their intervals.
class StepLimit {
public:
  // A function that changes by less than `tolerance`, relative to its largest value, limits nothing.
  StepLimit(OdeSystem &system, double start, double end, double tolerance)
      : start_(start), interval_((end - start) / static_cast<double>(intervals)) {
    if (system.prescribed() == 0)
      return;
    Eigen::ArrayXXd f(system.prescribed(), intervals + 1); // NaN where they have no finite value
    for (Index i = 0; i <= intervals; ++i)
      system.prescribe(start + interval_ * static_cast<double>(i), f.col(i).data());
    ArrayXd bend = ArrayXd::Zero(intervals + 1); // most of all functions
    for (Index k = 0; k < f.rows(); ++k) {
      const double whole = range(f.row(k), tolerance);
      if (!(whole > 0) || !std::isfinite(whole))
        continue;
      for (Index i = 1; i < intervals; ++i) {
        const double of_sample = std::abs(f(k, i - 1) - 2 * f(k, i) + f(k, i + 1)) / whole / interval_;
        if (of_sample > bend[i]) // not NaN
          bend[i] = of_sample;
      }
    }
    if (!(bend.sum() * (end - start) > most_bend))
      return; // steps as long as the run are none too long
    bend_.resize(bend.size());
    std::partial_sum(bend.begin(), bend.end(), bend_.begin());
  }

  // The step, or a shorter one
  double of(double t, double step) const {
    if (bend_.empty() || !(step > 0))
      return step;
    const auto first = static_cast<std::size_t>(std::clamp((t - start_) / interval_, 0.0, double(intervals)));
    const double before = first ? bend_[first - 1] : 0;
    for (std::size_t i = first; i < bend_.size(); ++i) {
      const double way = start_ + interval_ * static_cast<double>(i) - t; // to this sample
      if (way >= step)
        break;
      const double bend = bend_[i] - before;
      if (bend * step > most_bend && bend * (way + interval_) > most_bend)
        return std::min(step, std::max(way, most_bend / bend));
    }
    return step;
  }

private:
  static constexpr Index intervals = 1000;
  static constexpr double most_bend = 4; // of a step

  // Range of the values that are numbers; 0 where it is less than `tolerance` of the largest.
  template <class Values> static double range(const Values &f, double tolerance) {
    double least = INFINITY, most = -INFINITY;
    for (const double x : f)
      if (std::isfinite(x))
        least = std::min(least, x), most = std::max(most, x);
    const double between = most - least;
    return between > tolerance * std::max(std::abs(least), std::abs(most)) ? between : 0;
  }

  double start_, interval_;
  std::vector<double> bend_; // 1/s, up to and with each sample; empty where nothing bends
};

} // namespace ffrobot
