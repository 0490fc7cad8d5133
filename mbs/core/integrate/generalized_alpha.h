// Generalized-alpha on the equations of motion with constraints: order 2, adaptive, damping at high frequencies to
// taste. J. Chung, G. M. Hulbert, J. Appl. Mech. 60 (1993); M. Arnold, O. Bruels, Multibody Syst. Dyn. 18 (2007); in
// the stabilised index-2 form of M. Arnold, O. Bruels, A. Cardona, Numer. Math. 129 (2015): velocities meet C_dot = 0
// by the multipliers of the equations of motion, positions meet C = 0 by multipliers of their own.
#pragma once

#include "core/integrate/implicit_method.h"

namespace ffrobot {

class GeneralizedAlpha final : public ImplicitMethod {
public:
  // spectral_radius: what a step leaves of vibrations far above 1 / h; 1: no damping, 0: all of it
  GeneralizedAlpha(OdeSystem &system, double spectral_radius);

  bool step(double t, const double *y, double h, double tolerance) override;
  void estimate(double h, VectorXd &error) override;
  double error_order() const override { return 3; }
  double error_share(double fraction) const override { return fraction; }
  void accept(double h) override;
  void restart() override {
    started_ = false;
    previous_step_ = 0;
  }

  void interpolate(double t, double *y) const override; // cubic Hermite polynomial

private:
  void start(double t, const double *y, double h);
  void advance(const double *y, double h); // end_ from the accelerations
  bool iterate(double t, const double *y, double h, bool is_first);
  void stiff_force(const VectorXd &x); // force_, with B^T force_ = (N - M) x

  double alpha_m_, alpha_f_, beta_, gamma_, leading_;
  double damping_factor_ = 0, stiffness_factor_ = 0;
  // v_dot: accelerations at the start, end and before; a: the method's own, behind them by alpha_m - alpha_f steps
  VectorXd v_dot_, next_v_dot_, previous_v_dot_, drift_, a_, next_a_, position_correction_;
  VectorXd change_, excess_, force_, x_, c_;
  double previous_step_ = 0;
  bool started_ = false;
};

} // namespace ffrobot
