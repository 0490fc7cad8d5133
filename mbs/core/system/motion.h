// The equations of motion of a System as an OdeSystem: all coordinates are integrated (y = (q, q_dot), index 1) and
// projected onto C = 0 and C_dot = 0 after every step.
#pragma once

#include "core/integrate/ode.h"
#include "core/system/iteration_matrix.h"
#include "core/system/system.h"

#include <memory>

namespace ffrobot {

// Steers a system from outside: sets workspace.external_drive and external_modal for time t.
class ExternalLoads {
public:
  virtual ~ExternalLoads() = default;
  virtual void steer(double t, Workspace &workspace) = 0;
};

class ConstrainedMotion final : public ImplicitSystem {
public:
  // group[i]: constraints whose multipliers are judged together (the force of a joint, the moment of a joint …);
  // moment[i]: whether constraint i carries a moment. steering may be null.
  ConstrainedMotion(const System &system, std::vector<int> group, std::vector<bool> moment, ExternalLoads *steering);

  // How long the motion will last: what is slow or small is judged by it. Before the first accepted().
  void plan(double duration);

  Eigen::Index size() const override { return 2 * system_.coordinates; }
  void slope(double t, const double *y, double *dy) override;
  bool correct(double t, double *y) override;
  double error_size(double t, const double *y, const double *e) override;
  void accepted(double t, const double *y, const double *dy) override;
  Eigen::VectorXd save() const override;
  void restore(const Eigen::VectorXd &gathered) override;
  bool is_sensible(const double *y) const override;
  double initial_step() const override;
  unsigned long evaluations() const override { return workspace_.evaluations; }

  Eigen::Index constraints() const override { return lambda_.size(); }
  const Eigen::VectorXd &stiffness() const override { return stiffness_; }
  const Eigen::VectorXd &damping() const override { return damping_; }
  void factorise(double damping_factor, double stiffness_factor) override;
  void factorise(Complex damping_factor, Complex stiffness_factor) override;
  void solve(const double *r, const double *c, double *x) override { real_->solve(r, c, x); }
  void solve(const Complex *r, Complex *x) override { complex_->solve(r, nullptr, x); }
  void constrain(const double *x, double *c) override { real_->constrain(x, c); }
  void constraint_values(double t, const double *y, double *value, double *rate) override;
  double change_size(const double *y, const double *change, double rate) const override;

  const System &system() const { return system_; }
  Workspace &workspace() { return workspace_; }

private:
  Eigen::VectorXd applied_modal_force(std::size_t b) const;

  const System &system_;
  Workspace workspace_;
  std::vector<int> group_;
  std::vector<bool> group_is_moment_;
  ExternalLoads *steering_;
  double rate_ = 1;                        // 1/s: rates far below it do not count
  std::vector<Eigen::VectorXd> frequency_; // of each body's modes, rad/s
  Eigen::VectorXd stiffness_, damping_;    // diagonals over all coordinates
  std::unique_ptr<IterationMatrix<double>> real_;
  std::unique_ptr<IterationMatrix<Complex>> complex_;

  double state_size(const double *y, const double *e) const; // error_size without multipliers
  bool has_inertia() const;
  void measure_groups(const Eigen::VectorXd &lambda, Eigen::VectorXd &size) const;

  // peaks so far
  struct BodyPeaks {
    double velocity = 0, angular_velocity = 0, modal = 0, modal_velocity = 0;
    double acceleration = 0, angular_acceleration = 0, modal_acceleration = 0;
  };
  std::vector<BodyPeaks> body_peaks_;
  Eigen::VectorXd multiplier_peaks_, group_now_, group_error_; // of each group
  Eigen::VectorXd lambda_, shifted_, shifted_slope_, applied_;
  bool has_lambda_ = false;
};

} // namespace ffrobot
