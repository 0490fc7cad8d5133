#include "core/recursion/motion/scene_forces.h"

#include "core/recursion/motion/natural_sizes.h"

namespace ffrobot::recursion {

Load::Load(const VectorXd &direction, TimeFunction magnitude_) : magnitude(std::move(magnitude_)) {
  for (Index i = 0; i < direction.size(); ++i)
    if (direction[i] != 0)
      along.emplace_back(static_cast<int>(i), direction[i]);
}

template <class Space>
SceneForces<Space>::SceneForces(const Mechanism<Space> &mechanism, const Scene &scene, const ZeroOrderHold *held,
                                ExternalForces *external)
    : mechanism_(mechanism), scene_(scene), held_(held), external_(external),
      length_(NaturalSizes<Space>(mechanism).length()),
      has_generalized_(held || external || !scene.loads.empty() || !scene.joint_forces.empty() || !scene.gears.empty()),
      has_wrenches_(external || !scene.point_loads.empty() || !scene.point_forces.empty() || !scene.cut_joints.empty()),
      generalized_(VectorXd::Zero(mechanism.n_v)), wrench_(VectorXd::Zero(Space::dim * mechanism.wrenches.size())),
      along_cuts_(VectorXd::Zero(scene.cut_joints.size())) {}

template <class Space>
typename SceneForces<Space>::Acting SceneForces<Space>::at(double t, const double *q, const double *v,
                                                           Workspace<Space, double> &w) {
  Acting found;
  if (has_generalized_) {
    add_along_coordinates(t, q, v);
    found.forces.generalized = generalized_.data();
  }
  if (!has_wrenches_)
    return found;
  wrench_.setZero();
  for (const PointLoad &load : scene_.point_loads)
    wrench_[Space::dim * load.wrench + load.component] += load.share * load.magnitude(t).value;
  if (external_)
    external_->add(t, q, generalized_.data(), wrench_.data());
  if (!scene_.point_forces.empty() || !scene_.cut_joints.empty()) {
    const auto &at = found.placed.emplace(place_all(q, v, found.forces.generalized, w));
    add_at_points(at, scene_.point_forces, t, length_, wrench_.data());
    cut_rates(at, scene_.cut_joints, along_cuts_.data());
    for (Index k = 0; k < along_cuts_.size(); ++k)
      along_cuts_[k] = -scene_.cut_joints[k].friction.resistance(along_cuts_[k]);
    for (const CutLoad &load : scene_.cut_loads)
      along_cuts_[load.joint] += load.share * load.magnitude(t).value;
    add_along_cuts(at, scene_.cut_joints, along_cuts_.data(), wrench_.data());
  }
  found.forces.wrench = wrench_.data();
  return found;
}

template <class Space> void SceneForces<Space>::add_along_coordinates(double t, const double *q, const double *v) {
  generalized_.setZero();
  for (const Load &load : scene_.loads) {
    const double magnitude = load.magnitude(t).value;
    for (const auto &[i, share] : load.along)
      generalized_[i] += magnitude * share;
  }
  for (const JointForce &joint : scene_.joint_forces)
    generalized_[joint.v] -= joint.stiffness * (q[joint.q] - joint.rest) + joint.friction.resistance(v[joint.v]);
  for (const auto &[a, b, ratio, spring, damping] : scene_.gears) {
    const double moment = spring.moment(q[a.q] - ratio * q[b.q]) + damping * (v[a.v] - ratio * v[b.v]);
    generalized_[a.v] -= moment, generalized_[b.v] += ratio * moment;
  }
  if (held_)
    held_->add(q, generalized_.data());
}

template class SceneForces<Planar>;
template class SceneForces<Spatial>;

} // namespace ffrobot::recursion
