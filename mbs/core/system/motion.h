// The equations of motion of a System as an OdeSystem: all coordinates are integrated (index 1) and projected onto
// C = 0 and C_dot = 0 after every step.
#pragma once

#include "core/integrate/ode.h"
#include "core/system/error_norm.h"
#include "core/system/iteration_matrix.h"
#include "core/system/system.h"

#include <memory>

namespace ffrobot {

// Loads from outside the system's own: sets workspace.external_drive and external_modal for time t.
class ExternalLoads {
public:
  virtual ~ExternalLoads() = default;
  virtual void apply(double t, Workspace &workspace) = 0;
};

class ConstrainedMotion final : public ImplicitSystem {
public:
  // The system, and external_loads, which may be null, must outlive this.
  ConstrainedMotion(const System &system, ErrorNorm norm, ExternalLoads *external_loads);
  // Multipliers are not judged: for steps that are made again, or of equal length.
  explicit ConstrainedMotion(const System &system) : ConstrainedMotion(system, {system, {}}, nullptr) {}

  void slope(double t, const double *z, double *z_dot) override;
  bool correct(double t, double *z) override;
  double error_size(double t, const double *z, const double *e) override;
  void accepted(double t, const double *z, const double *z_dot) override;
  bool is_sensible(const double *z) const override;
  Eigen::Index prescribed() const override; // of the system's own loads and of its constraints
  void prescribe(double t, double *f) override;
  double initial_step() const override { return 0.1 / norm_.fastest(); }
  unsigned long evaluations() const override { return workspace_.evaluations; }

  Eigen::Index constraints() const override { return workspace_.lambda.size(); }
  const Eigen::VectorXd &stiffness() const override { return stiffness_; }
  const Eigen::VectorXd &damping() const override { return damping_; }
  void factorise(double damping_factor, double stiffness_factor) override;
  void factorise(Complex damping_factor, Complex stiffness_factor) override;
  void solve(const double *r, const double *c, double *x) override { real_->solve(r, c, x); }
  void solve(const Complex *r, Complex *x) override { complex_->solve(r, nullptr, x); }
  void constrain(const double *x, double *c) override { real_->constrain(x, c); }
  void constraint_values(double t, const double *z, double *value, double *rate) override;
  // R, in the units of values, is among the coordinates, and its rates are.
  double value_size(const double *z, const Eigen::VectorXd &value) const override {
    return relative_size(value, Eigen::Map<const Eigen::VectorXd>(z, n_v()));
  }
  double rate_size(const double *z, const Eigen::VectorXd &rate) const override {
    return relative_size(rate, Eigen::Map<const Eigen::VectorXd>(z + n_v(), n_v()));
  }
  double change_size(const double *z, const double *change, double rate) const override {
    return norm_.of_change(z, change, rate);
  }

  const System &system() const { return system_; }
  Workspace &workspace() { return workspace_; }
  ErrorNorm &norm() { return norm_; }

private:
  static double relative_size(const Eigen::VectorXd &residual, const Eigen::Map<const Eigen::VectorXd> &x) {
    return residual.lpNorm<Eigen::Infinity>() / (1 + x.lpNorm<Eigen::Infinity>());
  }

  const System &system_;
  Workspace workspace_;
  ErrorNorm norm_;
  ExternalLoads *external_loads_;
  double evaluated_at_;                 // time of the last slope()
  Eigen::VectorXd stiffness_, damping_; // diagonals (n_v)
  std::unique_ptr<IterationMatrix<double>> real_;
  std::unique_ptr<IterationMatrix<Complex>> complex_;
  Eigen::VectorXd observed_; // at the end of the step that error_size() has judged last; empty before
  Eigen::VectorXd shifted_, shifted_slope_;
};

} // namespace ffrobot
