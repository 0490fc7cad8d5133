#include "core/integrate/generalized_alpha.h"

#include <cmath>

namespace ffrobot {

using VectorMap = Map<const VectorXd>;

GeneralizedAlpha::GeneralizedAlpha(OdeSystem &system, double spectral_radius)
    : ImplicitMethod(system), alpha_m_((2 * spectral_radius - 1) / (spectral_radius + 1)),
      alpha_f_(spectral_radius / (spectral_radius + 1)), beta_(0.25 * std::pow(1 + alpha_f_ - alpha_m_, 2)),
      gamma_(0.5 + alpha_f_ - alpha_m_), leading_((1 - alpha_m_) / (1 - alpha_f_)), v_dot_(n_), next_v_dot_(n_),
      previous_v_dot_(n_), drift_(n_), a_(n_), next_a_(n_), position_correction_(n_), change_(2 * n_), excess_(n_),
      force_(system.n_stiff()), x_(n_), c_(value_) {}

// Consistent initial accelerations, C_tt included, are the first slope. The method's own lie alpha_m - alpha_f steps
// ahead: their rate is taken from a difference.
void GeneralizedAlpha::start(double t, const double *y, double h) {
  const double shift = 1e-3 * h;
  v_dot_ = first_slope_.tail(n_);
  end_ = VectorMap(y, 2 * n_) + shift * first_slope_;
  system_.slope(t + shift, end_.data(), change_.data());
  drift_ = (alpha_m_ - alpha_f_) / shift * (change_.tail(n_) - v_dot_);
  started_ = true;
}

void GeneralizedAlpha::advance(const double *y, double h) {
  const VectorMap q(y, n_), v(y + n_, n_);
  end_.head(n_) = q + h * v + h * h * ((0.5 - beta_) * a_ + beta_ * next_a_) + position_correction_;
  end_.tail(n_) = v + h * ((1 - gamma_) * a_ + gamma_ * next_a_);
  next_v_dot_ = ((1 - alpha_m_) * next_a_ + alpha_m_ * a_ - alpha_f_ * v_dot_) / (1 - alpha_f_);
}

void GeneralizedAlpha::stiff_force(const VectorXd &x) {
  force_ << x, system_.coupling().transpose() * x;
  force_.array() *= (damping_factor_ * system_.damping() + stiffness_factor_ * system_.stiffness()).array();
}

// One iteration of Newton's method: change_ of the state, and what it does to accelerations and positions. True where
// positions moved.
bool GeneralizedAlpha::iterate(double t, const double *y, double h, bool is_first) {
  advance(y, h);
  system_.slope(t + h, end_.data(), change_.data());
  system_.constraint_values(t + h, end_.data(), value_.data(), rate_.data());
  // M v_dot + C_q^T lambda = Q, less the same with the accelerations that C_ddot = 0 would ask for: what is left is
  // M excess + C_q^T (...), and the multipliers are free to meet C_dot = 0.
  excess_ = (next_v_dot_ - change_.tail(n_)) / leading_;
  system_.constrain(excess_.data(), c_.data());
  c_ -= rate_ / (h * gamma_);
  stiff_force(excess_);
  system_.solve(force_.data(), c_.data(), x_.data());
  change_.tail(n_) = x_ - excess_;
  next_a_ += change_.tail(n_);
  c_ = h * beta_ / gamma_ * rate_ - value_;
  // Once a step, and again only where it matters: rounding would move stiff modes, and their forces, for ever.
  const bool moved = c_.size() > 0 && (is_first || !(system_.value_size(end_.data(), c_) <= 1e-9));
  x_.setZero();
  if (moved) {
    force_.setZero();
    system_.solve(force_.data(), c_.data(), x_.data());
    position_correction_ += x_;
  }
  change_.head(n_) = h * h * beta_ * change_.tail(n_) + x_;
  change_.tail(n_) *= h * gamma_;
  return moved;
}

bool GeneralizedAlpha::step(double t, const double *y, double h, double tolerance) {
  if (!started_)
    start(t, y, h);
  if (stale_)
    system_.linearise(t, y);
  stale_ = true;
  damping_factor_ = h * gamma_ / leading_;
  stiffness_factor_ = h * h * beta_ / leading_;
  system_.factorise(damping_factor_, stiffness_factor_);
  a_ = v_dot_ + h * drift_;
  next_a_ = a_;
  position_correction_.setZero();
  double previous_size = 0;
  bool moved_before = false;
  for (int iteration = 0; iteration < most_iterations; ++iteration) {
    const bool moved = iterate(t, y, h, iteration == 0);
    const double size = system_.change_size(y, change_.data(), 1 / h);
    if (!std::isfinite(size))
      return false;
    if (iteration > 0 && !moved_before) {
      const double rate = size / previous_size;
      // Where stiff forces are nothing but rounding, their size does not shrink: then the change of state has to do.
      const double left = rate < 1 ? rate / (1 - rate) * size : system_.change_size(y, change_.data(), 0);
      if (left <= std::max(newton_share * tolerance, rounding)) {
        stale_ = !(rate < slow_contraction);
        advance(y, h);
        return true;
      }
      if (!(rate < 1))
        return false;
    }
    moved_before = moved; // what the move does to forces shows in the next change only
    previous_size = size;
  }
  return false;
}

// Against the integral of the parabola through the last three accelerations (order 3), smoothed by N^-1 M: a difference
// of accelerations is large in stiff modes, what it does to them is not. The first step has a straight line only.
void GeneralizedAlpha::estimate(double h, VectorXd &error) {
  const VectorXd &next = next_v_dot_;
  auto e_q = error.head(n_), e_v = error.tail(n_);
  e_v = h * (0.5 * v_dot_ + 0.5 * next - (1 - gamma_) * a_ - gamma_ * next_a_);
  e_q = h * h * (v_dot_ / 3 + next / 6 - (0.5 - beta_) * a_ - beta_ * next_a_);
  if (previous_step_ > 0) {
    const VectorXd curvature =
        ((next - v_dot_) / h - (v_dot_ - previous_v_dot_) / previous_step_) / (h + previous_step_);
    e_v -= h * h * h / 6 * curvature;
    e_q -= h * h * h * h / 12 * curvature;
  } else {
    e_v += h / 12 * (next - v_dot_);
  }
  for (auto e : {error.head(n_), error.tail(n_)}) {
    excess_ = -e;
    stiff_force(excess_);
    system_.solve(force_.data(), nullptr, x_.data());
    e += x_;
  }
}

void GeneralizedAlpha::accept(double h) {
  previous_v_dot_ = v_dot_;
  v_dot_ = next_v_dot_;
  drift_ = (next_a_ - next_v_dot_) / h;
  previous_step_ = h;
}

void GeneralizedAlpha::interpolate(double t, double *y) const {
  Map<VectorXd>(y, 2 * n_) = hermite((t - t0_) / h_, h_, start_, end_, first_slope_, last_slope_);
}

} // namespace ffrobot
