#pragma once

#include "core/recursion/motion/motion.h"

#include <nanobind/eigen/dense.h>
#include <nanobind/nanobind.h>

#include "bindings/bindings.h"

void bind_tree_data(nanobind::module_ &m);
void bind_tree_motion(nanobind::module_ &m);
void bind_state_function(nanobind::module_ &m);
void bind_prescribed(nanobind::module_ &m);
void bind_tree_sampled(nanobind::module_ &m);
void bind_forward_motion(nanobind::module_ &m);
void bind_replay(nanobind::module_ &m);

namespace ffrobot::recursion {

// A mechanism with its workspace
template <class Space> struct Model {
  Mechanism<Space> mechanism;
  Workspace<Space, double> w;

  Model(const std::vector<BodyModel<typename Space::Data>> &bodies, const std::vector<typename Space::Marker> &ground,
        const std::vector<ConstraintModel> &rows, const std::vector<MarkerAt> &wrenches, const Eigen::VectorXd &gravity)
      : mechanism(bodies, ground, rows, wrenches, gravity), w(mechanism) {}

  Eigen::Index rows() const { return static_cast<Eigen::Index>(mechanism.constraints.size()); }
  void check_state(const Eigen::VectorXd &q, const Eigen::VectorXd &v) const {
    check_size("q", q.size(), mechanism.n_q);
    check_size("v", v.size(), mechanism.n_v);
  }
};

} // namespace ffrobot::recursion
