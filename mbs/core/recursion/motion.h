// The motion of a mechanism in joint coordinates as a system that all methods
// integrate: rows follow functions of time, forces act along joints and on
// modes; after every step the state is moved back onto the rows with the
// columns of the recursion.
#pragma once

#include "core/integrate/limit_watch.h"
#include "core/integrate/ode.h"
#include "core/recursion/cut.h"
#include "core/recursion/friction.h"
#include "core/recursion/held_forces.h"
#include "core/recursion/loop_watch.h"
#include "core/recursion/motion_norm.h"
#include "core/recursion/newton.h"
#include "core/recursion/point_force.h"
#include "core/recursion/posture.h"
#include "core/recursion/workspace.h"
#include "core/space/configuration_space.h"
#include "core/time_function/functions_of_time.h"

#include <algorithm>
#include <optional>

namespace ffrobot::recursion {

// `magnitude`(t) times a direction in generalized forces: joint moments, modal
// forces of patches.
struct Load {
  Load(const Eigen::VectorXd &direction,
       TimeFunction magnitude_); // direction (n_v)

  std::vector<std::pair<int, double>> along; // entries of v that it acts on
  TimeFunction magnitude;
};

// `share` times `magnitude`(t) along a component of the force (N), then the
// moment (N m), global axes, on a wrench of the mechanism.
struct PointLoad {
  int wrench = 0, component = 0;
  TimeFunction magnitude;
  double share = 1;
};

// How a marker of the ground turns.
struct DrivenMarker {
  int marker = 0;
  OrientationLaw law;
};

// Along a joint's coordinate: spring about `rest`, viscous and Coulomb
// friction.
struct JointForce {
  int q = 0, v = 0;     // of the coordinate
  double stiffness = 0; // N m/rad, N/m
  double rest = 0;      // rad, m
  Friction friction;
};

// Between two joint coordinates, as a gear that gives: moments (N m) of the twist a - ratio b on both.
struct GearSpring {
  struct Side {
    int q = 0, v = 0;
  } a, b;
  double ratio = 1;
  double stiffness = 0, damping = 0; // N m/rad, N m s/rad
};

// `share` times `magnitude`(t), N m or N, along the coordinate of a joint at which a loop is cut.
struct CutLoad {
  int joint = 0; // of the scene's cut joints
  TimeFunction magnitude;
  double share = 1;
};

// What a row follows: sign * law(t), with rate and acceleration.
struct Target {
  TimeFunction law;
  double sign = 1;

  Jet operator()(double t) const {
    const Jet jet = law(t);
    return {sign * jet.value, sign * jet.rate, sign * jet.acceleration};
  }
};

// Forces from outside that depend on time alone.
class Steering {
public:
  virtual ~Steering() = default;
  // Adds those at time t along v (n_v), and on the wrenches of the mechanism (wrenches, dim); q (n_q) says where
  // directions are that modes turn.
  virtual void add(double t, const double *q, double *force, double *wrench) = 0;
  virtual void foresee(const double *, int) {} // as OdeSystem has it
  virtual double end_of_step(double t, double h) { return t + h; }
};

// What motors must do in place of the forces on rows, where these hold trajectories.
template <class Space> class MotorForces {
public:
  virtual ~MotorForces() = default;
  virtual std::vector<bool> are_moments() const = 0; // N m, else N
  // At q (n_q), of which w has the kinematics and the multipliers
  virtual const Eigen::VectorXd &find(const double *q, const Workspace<Space, double> &w) = 0;
};

struct Scene {
  std::vector<Target> targets; // of rows
  std::vector<Load> loads;
  std::vector<PointLoad> point_loads;
  std::vector<PointForce> point_forces;
  std::vector<JointForce> joint_forces;
  std::vector<GearSpring> gears;
  std::vector<CutJoint> cut_joints;
  std::vector<CutLoad> cut_loads;
  std::vector<DrivenMarker> driven;
  std::optional<PostureWatch> watch;
  std::vector<LimitedCoordinate> limits; // of joints; told, nothing acts there
  bool has_loops = false; // closed by rows: steps do not lead across postures in which all rows depend on each other
  bool keeps_all_rows = false;   // who makes the scene has refused rows that depend on others
  std::vector<double> most_bent; // of each node, kg m^2: p^T p beyond it makes no sense; empty: none is too large
};

std::vector<Jet> targets_at(const Scene &scene, double t); // of all rows

// What a motion remembers of its steps: with it another one of the same mechanism goes on as if it had taken them.
struct MotionHistory {
  NormPeaks peaks;
  unsigned long accepted = 0;              // steps
  double least_ratio = 1, singular_at = 0; // of the watch, as in RecursiveMotion
  Eigen::VectorXd singular_posture;
  double watched_at = 0, determinant = 0;
};

template <class Space> class RecursiveMotion final : public ImplicitSystem {
public:
  // The mechanism and the scene must outlive this. Rows that depend on others
  // at time t and (q, v) are left out of the equations from there on; they are
  // to be consistent. What acts beside the scene's loads may be null, and must outlive this:
  // `held`, which may change between steps, and `steering`.
  RecursiveMotion(const Mechanism<Space> &mechanism, const Scene &scene, double t, const double *q, const double *v,
                  const HeldForces *held = nullptr, Steering *steering = nullptr);

  void plan(double duration) { norm_.plan(duration); } // s, of the run to come
  void judge(MotorForces<Space> &motors);              // their errors, too; must outlive this

  void slope(double t, const double *z, double *z_dot) override;
  void foresee(const double *times, int count) override;
  double end_of_step(double t, double h) override { return steering_ ? steering_->end_of_step(t, h) : t + h; }
  bool correct(double t, double *z) override;
  bool finish(double t, double *z, double *z_dot) override;
  double error_size(double t, const double *z, const double *e) override;
  double change_size(const double *z, const double *change, double rate) const override;
  void accepted(double t, const double *z, const double *z_dot) override;
  bool is_sensible(const double *z) const override;
  Eigen::Index prescribed() const override; // of the scene's loads and targets, which limit steps
  void prescribe(double t, double *f) override;
  double initial_step() const override { return 0.1 / std::max(fastest_, norm_.sizes().pace()); }
  unsigned long evaluations() const override { return workspace_.evaluations; }

  // implicit.cpp
  Eigen::Index constraints() const override { return value_.size(); }
  const Eigen::VectorXd &stiffness() const override { return stiffness_; }
  const Eigen::VectorXd &damping() const override { return damping_; }
  const Eigen::MatrixXd &coupling() const override { return coupling_; }
  void factorise(double damping_factor, double stiffness_factor) override;
  void factorise(Complex damping_factor, Complex stiffness_factor) override;
  void solve(const double *r, const double *c, double *x) override;
  void solve(const Complex *r, Complex *x) override;
  void constrain(const double *x, double *c) override;
  void constraint_values(double t, const double *z, double *value, double *rate) override;
  double value_size(const double *z, const Eigen::VectorXd &value) const override;
  double rate_size(const double *z, const Eigen::VectorXd &rate) const override;

  // At a state y = (q, v): accelerations (n_v); multipliers are in
  // workspace().lambda
  void evaluate(double t, const double *q, const double *v, double *a);
  // What the scene does there beside gravity, elasticity and damping of modes; valid until the next call
  Forces<double> act(double t, const double *q, const double *v);
  // Moves q (n_q) and v (n_v) onto the rows at time t; the largest residual left, as the norm compares these
  double project(double t, double *q, double *v);

  // Of the scene's watch, which looks at some of the accepted steps and where it is told to: the smallest ratio of
  // posture_at() so far, when, and q there; 1 before the first.
  void watch_posture(double t, const double *q);
  double least_ratio() const { return least_ratio_; }
  double singular_at() const { return singular_at_; }
  const Eigen::VectorXd &singular_posture() const { return singular_posture_; }

  MotionHistory history() const;
  void go_on(const MotionHistory &history); // throws std::invalid_argument where it is that of another mechanism

  // Forces on the wrenches of the mechanism (wrenches, dim) as at the last evaluation; null where none act
  const double *wrenches() const { return wrench_.size() > 0 ? wrench_.data() : nullptr; }
  const Workspace<Space, double> &workspace() const { return workspace_; }
  Workspace<Space, double> &workspace() { return workspace_; }

private:
  void update_targets(double t) {
    if (t == target_time_)
      return;
    now_ = next_foreseen_;
    if (now_ >= foreseen_times_.size() || foreseen_times_[now_] != t)
      look_up(t);
    next_foreseen_ = now_ + 1;
    target_time_ = t;
    target_ = targets_.data() + now_ * static_cast<std::size_t>(value_.size());
    if (!scene_.driven.empty())
      turn_markers(t);
  }
  void evaluate_here(double t, const double *q, const double *v, double *a); // evaluate(), inline
  void look_up(double t);                                                    // now_
  void turn_markers(double t);
  void find_laws(const double *times, int count);
  void residuals(double t, const double *q, const double *v, Workspace<Space, double> &w);
  double project(double t, double *q, double *v, Workspace<Space, double> &w); // w: where residuals are measured
  void act_along_cuts(double t);                                               // the same
  const Eigen::VectorXd *motors_at(const double *q); // of the last evaluation; null where they are not judged
  void find_stiff_terms();
  void take_posture();
  void find_coupling();
  Eigen::VectorXd stiff_rates() const;
  template <class Scalar>
  void factorise(NewtonMatrix<Space, Scalar> &matrix, Scalar damping_factor, Scalar stiffness_factor);
  template <class Scalar> void spread(const Scalar *r, Scalar *x) const;

  const Mechanism<Space> &mechanism_;
  const Scene &scene_;
  const HeldForces *held_;
  Steering *steering_;
  // of accelerations; of rows and of Newton's method, which must not disturb
  // these
  Workspace<Space, double> workspace_, measured_, newton_;
  bool has_given_, has_wrenches_; // generalized forces: force_, and wrench_
  bool is_placed_ = false;        // workspace_ has the kinematics of the state that will be evaluated next
  Eigen::VectorXd force_, wrench_, along_cuts_, value_, rate_, correction_, state_;
  FunctionsOfTime laws_; // that rows follow, up to their signs, at foreseen_times_
  Eigen::VectorXd sign_;
  std::vector<double> foreseen_times_, targets_; // accelerations of rows (times, rows)
  std::size_t next_foreseen_ = 0;                // of these times, most likely asked for next
  std::size_t now_ = 0;                          // of these, target_time_
  double target_time_;
  const double *target_ = nullptr; // (rows) accelerations there
  double fastest_ = 0;             // 1/s, of modes
  MotionNorm<Space> norm_;
  MotorForces<Space> *motors_ = nullptr;
  Eigen::VectorXd shifted_, unused_;
  // the worst posture along the path, and when
  double least_ratio_ = 1, singular_at_ = 0;
  Eigen::VectorXd singular_posture_;
  unsigned long accepted_ = 0, steps_between_postures_ = 1; // many where steps follow vibrations
  double watched_at_ = 0, determinant_ = 0;                 // of the posture before

  std::optional<LoopWatch<Space>> loops_; // where the scene has some

  Eigen::VectorXd stiffness_, damping_; // diagonals (n_v, then cut joints); of friction as at the last factorisation
  std::vector<Eigen::Index> turned_;    // stiff coordinates along pins whose section modes turn
  Eigen::MatrixXd coupling_;            // (n_v, cut joints) their rates are coupling^T v
  Eigen::VectorXd evaluated_, rates_;   // q and v of the last slope()
  NewtonPosture<Space> posture_;        // there, unless that is old: there was a slope since
  bool posture_is_old_ = true;
  Eigen::MatrixXd newton_rows_; // (kept rows, cut joints, turned_; n_v)
  NewtonMatrix<Space, double> real_;
  NewtonMatrix<Space, Complex> complex_;
};

} // namespace ffrobot::recursion
