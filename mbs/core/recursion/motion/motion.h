// The motion of a mechanism in joint coordinates as a system that all methods integrate: constraint equations follow
// functions of time, forces act along joints and on modes; after every step the state is moved back onto the constraint
// equations with the columns of the last evaluation.
#pragma once

#include "core/recursion/motion/constraint_laws.h"
#include "core/recursion/motion/loop_watch.h"
#include "core/recursion/motion/motion_norm.h"
#include "core/recursion/motion/newton_system.h"
#include "core/recursion/motion/scene_forces.h"

namespace ffrobot::recursion {

// What a motion remembers of its steps: with it another one of the same mechanism goes on as if it had taken them.
struct MotionHistory {
  NormPeaks peaks;
  unsigned long accepted = 0; // steps
  PostureHistory postures;
  std::vector<int> kept; // constraint equations

  FFROBOT_FIELDS(peaks, accepted, postures, kept);
};

template <class Space> class RecursiveMotion final : public NewtonSystem<Space> {
public:
  using OdeSystem::local, OdeSystem::n_v;

  // Constraint equations that depend on others at time t and (q, v) are left out; they are to be consistent. Mechanism,
  // scene and what acts beside its forces (as in SceneForces) must outlive this.
  RecursiveMotion(const Mechanism<Space> &mechanism, const Scene &scene, double t, const double *q, const double *v,
                  const ZeroOrderHold *held = nullptr, ExternalForces *external = nullptr);

  void plan(double begin, double end);    // s, of the run to come
  void judge(MotorForces<Space> &motors); // their errors, too; must outlive this

  void slope(double t, const double *z, double *z_dot) override;
  void set_stage_times(const double *times, int count) override;
  void round_off(const double *z, double relative, double *z_dot) override;
  double end_of_step(double t, double h) override { return forces_.end_of_step(t, h); }
  bool finish(double t, double *z, double *z_dot) override;
  double error_size(double t, const double *z, const double *e) override;
  double change_size(const double *z, const double *change, double rate) const override;
  void accepted(double t, const double *z, const double *z_dot) override;
  bool is_sensible(const double *z) const override;
  Index prescribed() const override; // of the scene's loads and targets, which limit steps
  void prescribe(double t, double *f) override;
  double initial_step() const override { return 0.1 / std::max(fastest_, norm_.sizes().pace()); }
  unsigned long evaluations() const override { return workspace_.evaluations; }

  Index constraints() const override { return value_.size(); }
  void linearise(double t, const double *z) override;
  void constraint_values(double t, const double *z, double *value, double *rate) override;
  double value_size(const double *z, const VectorXd &value) const override;
  double rate_size(const double *z, const VectorXd &rate) const override;

  // At a state (q, v): accelerations (n_v); multipliers are in workspace().lambda
  void evaluate(double t, const double *q, const double *v, double *a);
  // After that, or slope(): evaluates anew with others of redundant equations where those that are kept hardly differ
  void renew(double t, const double *q, const double *v, double *a = nullptr);
  // What acts there beside gravity, elasticity and damping of modes; valid until the next call
  Forces<double> act(double t, const double *q, const double *v) { return forces_.at(t, q, v, workspace_).forces; }
  // Moves q (n_q) and v (n_v) onto the constraint equations at time t; the largest residual left, as the norm compares
  // these. Where `is_next` that state is the next to be evaluated: its kinematics are kept.
  double project(double t, double *q, double *v, bool is_next = false);

  // Of the scene's watch, which looks at some of the accepted steps and where it is asked to
  void watch_posture(double t, const double *q);
  const PostureHistory &postures() const { return postures_; }

  MotionHistory history() const { return {norm_.peaks(), accepted_, postures_, workspace_.active}; }
  void go_on(const MotionHistory &history); // throws std::invalid_argument where it is that of another mechanism

  Workspace<Space, double> &workspace() { return workspace_; }

private:
  void go_to(double t) {
    if (laws_.go_to(t) && !scene_.driven.empty())
      turn_markers(t);
  }
  void turn_markers(double t);
  void evaluate_here(double t, const double *q, const double *v, double *a); // evaluate(), inline
  bool correct(double t, double *z); // moves z onto the constraint equations; false where that fails
  Placed<Space, double> residuals(double t, const double *q, const double *v, Workspace<Space, double> &w);
  const VectorXd *motors_at(const double *q); // of the last evaluation; null where they are not judged

  using NewtonSystem<Space>::mechanism_, NewtonSystem<Space>::scene_, NewtonSystem<Space>::at_rest_;
  Workspace<Space, double> workspace_, measured_; // of accelerations; of residuals, which must not disturb these
  // Where workspace_ has the kinematics of the state that will be evaluated next
  std::optional<Placed<Space, double>> placed_;
  SceneForces<Space> forces_;
  // What acts along a coordinate that a constraint equation prescribes moves nothing: its multiplier bears that, and
  // what is left of both in sums would be rounding.
  struct Borne {
    int v, row;
    double force; // of the last evaluation, N m or N
  };
  std::vector<Borne> borne_;
  ConstraintLaws laws_;
  MotionNorm<Space> norm_;
  MotorForces<Space> *motors_ = nullptr;
  std::optional<LoopWatch<Space>> loops_; // where the scene has some
  PostureHistory postures_;
  unsigned long accepted_ = 0, steps_between_postures_ = 1; // many where steps follow vibrations
  double between_postures_ = 0;                             // s
  double fastest_ = 0;                                      // 1/s, of modes

  VectorXd value_, rate_;                          // (constraints)
  VectorXd correction_, state_, shifted_, unused_; // of projections; (q, v); of error_size()
};

extern template class RecursiveMotion<Planar>;
extern template class RecursiveMotion<Spatial>;

} // namespace ffrobot::recursion
