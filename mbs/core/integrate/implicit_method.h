// What implicit methods share: steps that end on C = 0 and C_dot = 0.
#pragma once

#include "core/integrate/method.h"

namespace ffrobot {

class ImplicitMethod : public Method {
public:
  bool finish(double t) final {
    if (!correct(t))
      return false;
    system_.slope(t, end_.data(), last_slope_.data());
    return true;
  }

  bool lands_on_outputs() const final { return true; } // interpolations are less good than the steps
  void prepare_dense(double t, const double *y, double h) override {
    start_ = Map<const VectorXd>(y, 2 * n_);
    t0_ = t, h_ = h;
  }

  double *end() final { return end_.data(); }
  double *first_slope() final { return first_slope_.data(); }
  double *last_slope() final { return last_slope_.data(); }

protected:
  explicit ImplicitMethod(OdeSystem &system)
      : system_(system), n_(system.n_v()), end_(2 * n_), start_(end_), first_slope_(end_), last_slope_(end_),
        value_(system.constraints()), rate_(value_), none_(VectorXd::Zero(system.n_stiff())), correction_(n_) {}

  virtual bool correct(double t) { return project(t); } // moves end_ back onto the invariants; false where that fails

  // The same in the metric of the iteration matrix, after factorise(real). In the mass metric stiff modes would take up
  // a part of every correction, and give it back as a force K p that no step resolves; in this one they hardly move.
  bool project(double t) {
    double *y = end_.data();
    const auto values = [&] { return system_.value_size(y, value_); };
    const auto rates = [&] { return system_.rate_size(y, rate_); };
    const auto move_positions = [&](const VectorXd &step) { system_.local().shift(y, -1, step.data()); };
    const auto move_velocities = [&](const VectorXd &step) { end_.tail(n_) -= step; };
    // Positions first: moving them changes velocities, not the other way round.
    return value_.size() == 0 ||
           (settle(t, value_, values, move_positions) && settle(t, rate_, rates, move_velocities));
  }

  static constexpr int most_iterations = 12;   // of Newton's method
  static constexpr double newton_share = 0.01; // of the step's tolerance that the iteration may leave
  static constexpr double rounding = 1e-14;
  static constexpr double slow_contraction = 0.02; // geometry is taken anew when Newton's method is slower than this

  OdeSystem &system_;
  Index n_; // n_v: half the size of y
  VectorXd end_, start_, first_slope_, last_slope_, value_, rate_;
  double t0_ = 0, h_ = 0;
  bool stale_ = true; // the geometry of the last factorisation

private:
  // Newton steps on the positions or velocities at the end until the size() of `residual` vanishes; move(step) takes a
  // step off them.
  template <class Size, class Move>
  bool settle(double t, const VectorXd &residual, const Size &size, const Move &move) {
    constexpr double tolerance = 1e-12, rounding_floor = 1e-11;
    double left = 0, previous = 1e300;
    for (int i = 0; i < most_iterations; ++i) {
      system_.constraint_values(t, end_.data(), value_.data(), rate_.data());
      left = size();
      const double worth_going_on = left < rounding_floor ? 0.2 : 0.9;
      if (!(left > tolerance) || left > worth_going_on * previous)
        break; // done, NaN, or too slow
      previous = left;
      system_.solve(none_.data(), residual.data(), correction_.data());
      move(correction_);
    }
    return left < rounding_floor;
  }

  VectorXd none_, correction_;
};

} // namespace ffrobot
