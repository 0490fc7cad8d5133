#pragma once

#include "core/recursion/motion/motion.h"

#include <nanobind/eigen/dense.h>

#include "bindings/bindings.h"

void bind_tree_data(nb::module_ &m);
void bind_tree_motion(nb::module_ &m);
void bind_state_function(nb::module_ &m);
void bind_prescribed(nb::module_ &m);
void bind_tree_sampled(nb::module_ &m);
void bind_forward_motion(nb::module_ &m);
void bind_replay(nb::module_ &m);

namespace ffrobot::recursion {

// A mechanism with its workspace
template <class Space> struct Model {
  Mechanism<Space> mechanism;
  Workspace<Space, double> w;

  Model(const std::vector<BodyModel<typename Space::Data>> &bodies, const std::vector<typename Space::Marker> &ground,
        const std::vector<ConstraintModel> &rows, const std::vector<MarkerAt> &wrenches, const VectorXd &gravity)
      : mechanism(bodies, ground, rows, wrenches, gravity), w(mechanism) {}

  Index rows() const { return mechanism.constraints.size(); }
  void check_state(const VectorXd &q, const VectorXd &v) const {
    check_size("q", q.size(), mechanism.n_q);
    check_size("v", v.size(), mechanism.n_v);
  }
};

} // namespace ffrobot::recursion
