// A motion that is wholly prescribed (Shabana 2022, sec. 5.1): the modes by functions of time, the joints by constraint
// equations C = 0. With J columns of joints and p of modes
//
//     C_J v_J = C_t - C_p p_dot,    C_J a_J = -(C_ddot with a_J = 0)
//     C_J^T lambda = -f_J,          shape force = f_p + C_p^T lambda        with f = M a - Q
//
// give the motion of the joints, and the forces that hold trajectories and shape. Equations may depend on others that
// go with them: lambda is the smallest then.
#pragma once

#include "core/recursion/inverse/force_slopes.h"
#include "core/recursion/inverse/motors.h"

namespace ffrobot::recursion {

// p, p_dot, p_ddot of all bodies, in the order of DrivenMechanism::of_modes
struct ModalMotion {
  VectorXd p, p_dot, p_ddot;
};

using ModalShape = std::vector<TimeFunction>; // p_k(t) of one body
ModalMotion modes_at(const std::vector<ModalShape> &shape, double t);

// How the motion of all coordinates answers to small changes of p, p_dot and p_ddot, (n_v, modes) each. By p_dot v, and
// by p_ddot a, change as q by p does.
struct JointSlopes {
  MatrixXd q, v, a_p, a_v; // of q, v and a by p, of a by p_dot
};

struct LeftSlopes {
  MatrixXd M, D, K; // (modes + motors, modes) of what is left and of torques, by p_ddot, p_dot, p
};

template <class Space> class PrescribedMotion {
public:
  using TreeWorkspace = Workspace<Space, double>;

  // Throws std::invalid_argument where constraint equations are fewer than coordinates of joints.
  PrescribedMotion(DrivenMechanism<Space> driven, const VectorXd &q);
  PrescribedMotion(const PrescribedMotion &) = delete;
  virtual ~PrescribedMotion() = default;

  // The next position is found from the joints of q (n_q), without looking at the last one.
  virtual void start_at(const VectorXd &q);

  // The joints' motion at time t for these modes; false where no position is found. From the last position, along its
  // velocity, or from where it starts.
  virtual bool move(double t, const ModalMotion &modes);
  void balance(); // then: the forces of that motion

  const VectorXd &state() const { return state_; } // (q, v)
  const double *q() const { return state_.data(); }
  const double *v() const { return state_.data() + driven_.mechanism.n_q; }
  const VectorXd &a() const { return a_; }               // (n_v)
  const VectorXd &lambda() const { return lambda_; }     // (constraint equations)
  const VectorXd &required() const { return required_; } // (n_v) f
  VectorXd shape_force() const;                          // (modes)
  const Motors<Space> *motors(); // in place of all that is required along joints; null where there are none
  VectorXd left();               // (modes) that motors, or without any the constraint equations, leave
  // After balance(), as the next ones; then comes the next move(). Coordinates that are a path, if any, change as in
  // `followed`.
  JointSlopes joint_slopes(const JointSlopes *followed = nullptr);
  virtual LeftSlopes slopes() { return left_slopes(joint_slopes()); } // of left() and of motors along joints; exact
  const DrivenMechanism<Space> &driven() const { return driven_; }
  Index modes() const { return driven_.of_modes.size(); }

  TreeWorkspace &workspace() { return w_; } // with kinematics, accelerations of frames, multipliers

protected:
  bool follow(double t, const ModalMotion &modes, std::vector<Jet> targets); // of constraint equations
  // With the joints' motion of another one
  LeftSlopes left_slopes(const JointSlopes &joints);
  void take_joints(double t, const ModalMotion &modes, const PrescribedMotion &other);
  // What constraint equations of this mechanism measure in another motion of the same bodies.
  std::vector<Jet> measured_in(const PrescribedMotion &other);

private:
  Derivatives derivatives_under(const VectorXd &forces, const std::vector<int> &active);
  void set_modes(const ModalMotion &modes);
  void act(double t); // at the state that was measured
  bool find_position();
  void measure();
  void factorise();
  void go(double factor, const VectorXd &values); // joints in q

  const DrivenMechanism<Space> driven_;
  const ConfigurationSpace space_;
  RecursiveMotion<Space> motion_; // what acts
  Forces<double> acting_;
  TreeWorkspace w_;
  NewtonEuler<Space> forces_;
  const NaturalSizes<Space> sizes_;
  std::optional<Motors<Space>> motors_;
  std::vector<int> modes_in_q_, angles_; // of of_modes; of of_joints, by numbers there
  std::vector<Jet> targets_;
  VectorXd state_, a_, lambda_, required_, f_, value_, rate_;
  VectorXd Q_, step_; // (n_v), (n_v) zero along modes
  LeastNorm factors_;
  double time_ = 0;
  bool goes_on_ = false;
};

// The motion with the motors' coordinates that another one has, whose path is that of the scene, with deflections
// factor p + offset(t). Its own mechanism has the motors' coordinates in place of the path. It is the other one's where
// these are the coordinates of all joints.
template <class Space> class RedefinedMotion final : public PrescribedMotion<Space> {
public:
  // offset: one function for each mode of all bodies, or none.
  RedefinedMotion(DrivenMechanism<Space> driven, DrivenMechanism<Space> path, const VectorXd &q, double factor,
                  std::vector<TimeFunction> offset);

  void start_at(const VectorXd &q) override { path_.start_at(q); }
  LeftSlopes slopes() override;
  bool move(double t, const ModalMotion &modes) override;

private:
  PrescribedMotion<Space> path_;
  double factor_;
  ModalShape offset_;
};

extern template class PrescribedMotion<Planar>;
extern template class PrescribedMotion<Spatial>;
extern template class RedefinedMotion<Planar>;
extern template class RedefinedMotion<Spatial>;

} // namespace ffrobot::recursion
