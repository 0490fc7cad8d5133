// What acts on a mechanism beside gravity, elasticity and damping of modes: the forces of a scene, and those of others.
#pragma once

#include "core/recursion/motion/scene.h"
#include "core/recursion/motion/zero_order_hold.h"

namespace ffrobot::recursion {

// Forces from outside that depend on time alone.
class ExternalForces {
public:
  virtual ~ExternalForces() = default;
  // Adds those at time t along v (n_v), and on the wrenches of the mechanism (wrenches, dim); q (n_q) says where
  // directions are that modes turn.
  virtual void add(double t, const double *q, double *force, double *wrench) = 0;
  virtual void set_stage_times(const double *, int) {} // as OdeSystem has it
  virtual double end_of_step(double t, double h) { return t + h; }
};

// Mechanism, scene and what acts beside it must outlive this; `held`, which may change between steps, and `external`
// may be null.
template <class Space> class SceneForces {
public:
  SceneForces(const Mechanism<Space> &mechanism, const Scene &scene, const ZeroOrderHold *held,
              ExternalForces *external);

  bool acts() const { return has_generalized_ || has_wrenches_; }

  // Valid until the next call. `placed`: where forces depend on how sections move, w has the kinematics of the state.
  struct Acting {
    Forces<double> forces;
    std::optional<Placed<Space, double>> placed;
  };
  Acting at(double t, const double *q, const double *v, Workspace<Space, double> &w);

  // Takes what acts along an entry of v out of the generalized forces of the last at().
  double take(int v) { return has_generalized_ ? std::exchange(generalized_[v], 0.0) : 0; }

  const double *generalized() const { return has_generalized_ ? generalized_.data() : nullptr; } // of the last at()

  void set_stage_times(const double *times, int count) {
    if (external_)
      external_->set_stage_times(times, count);
  }
  double end_of_step(double t, double h) { return external_ ? external_->end_of_step(t, h) : t + h; }

private:
  void add_along_coordinates(double t, const double *q, const double *v);

  const Mechanism<Space> &mechanism_;
  const Scene &scene_;
  const ZeroOrderHold *held_;
  ExternalForces *external_;
  const double length_; // m, natural one
  const bool has_generalized_, has_wrenches_;
  VectorXd generalized_, wrench_, along_cuts_; // (n_v), (wrenches, dim), (cut joints)
};

} // namespace ffrobot::recursion
