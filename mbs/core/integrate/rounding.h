// What of a step's error estimate is rounding of its states.
#pragma once

#include "core/integrate/method.h"

#include <limits>
#include <random>

namespace ffrobot {

class Rounding {
public:
  // Entries are shifted each by another amount: springs between angles that are equal are to notice. Evenly spread
  // sequences will not do: their members nearly agree at some distances.
  explicit Rounding(OdeSystem &system)
      : system_(system), shift_(system.size()), shifted_(system.size()), left_(system.size()), found_(system.size()) {
    std::minstd_rand random;
    std::uniform_real_distribution<double> share(-1, 1);
    for (double &of_entry : shift_)
      of_entry = rounding * share(random);
  }

  // The error that rounding of slopes leaves in the `error` that `method` has estimated of its step of `step` s from
  // (t, z) with the slope z_dot; zero where that is no notable part of it. It is in proportion to the step, as is the
  // part of the tolerance that one step of many may take: no shorter step would do better. Three kinds are looked for.
  // Stiff springs between angles amplify the rounding of states, where nothing moves and nothing else is as large.
  // Forces cancel but for their own rounding, as loads and what carries them: OdeSystem::round_off, of the last slope,
  // near the end of the step. Sections with next to no inertia, as tips of beams and rods about their axes, amplify the
  // rounding of all sums: there slopes scatter however little states differ. Takes two slopes; none for some calls,
  // `without_look`, after one that found next to nothing. Valid until the next call.
  const VectorXd &error(double t, const double *z, const double *z_dot, double step, Method &method,
                        const VectorXd &error, int &without_look) {
    using VectorMap = Map<const VectorXd>;
    left_.setZero();
    if (without_look > 0) {
      --without_look;
      return left_;
    }
    const Index n = system_.size();
    double largest = 0;
    const auto take_larger = [&] {
      method.slopes_to_error(step, found_);
      const double size = system_.change_size(z, found_.data(), 1 / step);
      if (size > largest)
        largest = size, left_.swap(found_);
    };
    system_.round_off(method.end(), rounding, found_.data());
    take_larger();
    for (const double reach : {many, 1.0}) {
      shifted_ = VectorMap(z, n).array() * (1 + reach * shift_);
      system_.slope(t, shifted_.data(), found_.data());
      found_ = (found_ - VectorMap(z_dot, n)) / reach;
      take_larger();
    }
    const double whole = system_.change_size(z, error.data(), 1 / step);
    if (largest < far * whole)
      without_look = next_steps;
    if (!(largest > notable * whole))
      left_.setZero();
    return left_;
  }

private:
  static constexpr double notable = 0.1;                                         // of the error
  static constexpr double rounding = 2 * std::numeric_limits<double>::epsilon(); // of an entry, relative, after sums
  static constexpr double far = 0.01 * notable; // where it is less, the next steps need no look
  static constexpr int next_steps = 10;
  static constexpr double many = 100; // roundings that entries are shifted by at most: so many that no two are equal

  OdeSystem &system_;
  ArrayXd shift_; // (n) of a state's entries, in roundings
  VectorXd shifted_, left_, found_;
};

} // namespace ffrobot
