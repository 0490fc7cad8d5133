// A motion in joint coordinates that is wholly prescribed (Shabana 2022, sec. 5.1): the modes by what they are told,
// the joints by the rows C = 0, as many as joints have coordinates. With J columns of joints and p of modes
//
//     C_J v_J = C_t - C_p p_dot,    C_J a_J = -(C_ddot with a_J = 0)
//     C_J^T lambda = -f_J,          shape force = f_p + C_p^T lambda        with f = M a - Q
//
// give the motion of the joints, and the forces that hold trajectories and shape.
#pragma once

#include "core/analysis/motors_on_tree.h"

#include <Eigen/LU>

#include <memory>
#include <optional>

namespace ffrobot {

// p, p_dot, p_ddot of all bodies, in the order of the system
struct ModalMotion {
  Eigen::VectorXd p, p_dot, p_ddot;
};

using ModalShape = std::vector<TimeFunction>; // p_k(t) of one body
ModalMotion modes_at(const std::vector<ModalShape> &shape, double t);

class PrescribedMotion {
public:
  using Workspace = recursion::Workspace<recursion::Planar, double>;

  // both must outlive this. Throws std::invalid_argument where rows are not as many as coordinates of joints.
  PrescribedMotion(const SystemOnTree &both, const Eigen::VectorXd &q);

  virtual ~PrescribedMotion() = default;

  // The next position is found from the joints of q (n_q), without looking at the last one.
  virtual void start_at(const Eigen::VectorXd &q);

  // The joints' motion at time t for these modes; false where no position is found. From the last position, along its
  // velocity, or from where it starts.
  virtual bool move(double t, const ModalMotion &modes);
  void balance(); // then: the forces of that motion

  const Eigen::VectorXd &state() const { return state_; } // (q, v) of the tree
  const double *q() const { return state_.data(); }
  const Eigen::VectorXd &a() const { return a_; }           // (n_v)
  const Eigen::VectorXd &lambda() const { return lambda_; } // (rows)
  Eigen::VectorXd shape_force() const;                      // (modes of all bodies)
  Eigen::VectorXd left();                                  // the same with motors in place of rows, where there are any
  const Eigen::VectorXd &values() const { return value_; } // C and its rate, which should be zero
  const Eigen::VectorXd &rates() const { return rate_; }
  const std::vector<Jet> &targets() const { return targets_; }
  const SystemOnTree &both() const { return both_; }

  Workspace &workspace() { return w_; } // with kinematics, accelerations of frames, multipliers
  const Workspace &workspace() const { return w_; }
  const double *wrenches() const { return acting_.wrench; }

protected:
  bool follow(double t, const ModalMotion &modes, std::vector<Jet> targets); // of rows
  // What rows of `both` measure in another motion of the same bodies.
  std::vector<Jet> measured_in(const PrescribedMotion &other);

private:
  void set_modes(const ModalMotion &modes);
  bool find_position();
  void measure();
  void factorise();
  void put_on_joints(const Eigen::VectorXd &values, double *to) const;

  const SystemOnTree &both_;
  std::unique_ptr<TreeMotion> motion_; // what acts
  recursion::Forces<double> acting_;
  Workspace w_;
  recursion::NewtonEuler<recursion::Planar> forces_;
  std::optional<MotorsOnTree> motors_;
  std::vector<int> joints_; // their coordinates in v, which are in q at the same places
  std::vector<Jet> targets_;
  Eigen::VectorXd state_, a_, lambda_, f_, value_, rate_;
  Eigen::VectorXd unit_, Q_; // (rows) zero between calls, (n_v)
  Eigen::MatrixXd C_J_;      // (rows, rows)
  Eigen::PartialPivLU<Eigen::MatrixXd> factors_;
  double time_ = 0;
  bool goes_on_ = false;
};

// The motion with the motors' coordinates that another one has, whose rows are the path: where the deflections are
// factor p + offset(t). Its own rows are those of the motors, in the place of the path.
class RedefinedMotion final : public PrescribedMotion {
public:
  // Both must outlive this. offset: one function for each mode of all bodies, or none.
  RedefinedMotion(const SystemOnTree &driven, const SystemOnTree &path, const Eigen::VectorXd &q, double factor,
                  std::vector<TimeFunction> offset);

  void start_at(const Eigen::VectorXd &q) override { path_.start_at(q); }
  bool move(double t, const ModalMotion &modes) override;

private:
  PrescribedMotion path_;
  double factor_;
  ModalShape offset_;
};

} // namespace ffrobot
