#include "core/integrate/step_limit.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace ffrobot {

using Eigen::ArrayXd;
using Eigen::Index;

namespace {

constexpr Index intervals = 1000;
constexpr double most_bend = 4; // of a step, as step_limit.h says

// Row i: the functions at the sample i; NaN where they have no finite value
Eigen::ArrayXXd samples(OdeSystem &system, double start, double interval) {
  Eigen::ArrayXXd f(intervals + 1, system.prescribed());
  Eigen::VectorXd now(system.prescribed());
  for (Index i = 0; i <= intervals; ++i) {
    system.prescribe(start + interval * static_cast<double>(i), now.data());
    f.row(i) = now.transpose();
  }
  return f;
}

// Range of the values that are numbers; 0 where it is less than `tolerance` of the largest.
double range(const Eigen::Ref<const ArrayXd> &f, double tolerance) {
  double least = INFINITY, most = -INFINITY;
  for (const double x : f)
    if (std::isfinite(x))
      least = std::min(least, x), most = std::max(most, x);
  const double between = most - least;
  return between > tolerance * std::max(std::abs(least), std::abs(most)) ? between : 0;
}

} // namespace

StepLimit::StepLimit(OdeSystem &system, double start, double end, double tolerance)
    : start_(start), interval_((end - start) / static_cast<double>(intervals)) {
  if (system.prescribed() == 0)
    return;
  const Eigen::ArrayXXd f = samples(system, start, interval_);
  ArrayXd bend = ArrayXd::Zero(intervals + 1); // most of all functions
  for (Index k = 0; k < f.cols(); ++k) {
    const double whole = range(f.col(k), tolerance);
    if (!(whole > 0) || !std::isfinite(whole))
      continue;
    for (Index i = 1; i < intervals; ++i) {
      const double of_sample = std::abs(f(i - 1, k) - 2 * f(i, k) + f(i + 1, k)) / whole / interval_;
      if (of_sample > bend[i]) // not NaN
        bend[i] = of_sample;
    }
  }
  if (!(bend.sum() * (end - start) > most_bend))
    return; // steps as long as the run are none too long
  bend_.resize(bend.size());
  std::partial_sum(bend.begin(), bend.end(), bend_.begin());
}

double StepLimit::of(double t, double step) const {
  if (bend_.empty() || !(step > 0))
    return step;
  const auto first = static_cast<std::size_t>(std::clamp((t - start_) / interval_, 0.0, double(intervals)));
  const double before = bend_before(first);
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

} // namespace ffrobot
