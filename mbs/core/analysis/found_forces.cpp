#include "core/analysis/found_forces.h"

#include "core/linear/dense.h"
#include "core/recursion/constrained_aba/once.h"

namespace ffrobot::recursion {

template <class Space>
RecordedForces<Space>::RecordedForces(const Mechanism<Space> &mechanism, const Scene &scene, const Recording &recording,
                                      std::shared_ptr<ForceReader<Space>> reader)
    : ForceSource(reader->count()), motion_(mechanism, scene, recording.times.front(), recording.states.data(),
                                            recording.states.data() + mechanism.n_q),
      recorded_(motion_, recording), reader_(std::move(reader)) {
  motion_.plan(recording.times.front(), recording.times.back());
}

template <class Space> bool RecordedForces<Space>::find(double t) {
  const double *q = recorded_.state(t);
  motion_.renew(t, q, q + motion_.workspace().m.n_q);
  reader_->read(q, motion_.workspace(), nullptr, values_.data());
  return !recorded_.is_at_stage();
}

template <class Space>
PrescribedForces<Space>::PrescribedForces(PrescribedMotion<Space> &motion, std::vector<ModalShape> shape,
                                          const VectorXd &q, std::shared_ptr<ForceReader<Space>> reader)
    : ForceSource(reader->count()), motion_(motion), shape_(std::move(shape)),
      holding_(VectorXd::Zero(motion.driven().mechanism.n_v)), reader_(std::move(reader)) {
  motion_.start_at(q);
}

template <class Space> bool PrescribedForces<Space>::find(double t) {
  // was found at all output times before; a failure in between shows as a step that is refused
  if (motion_.move(t, modes_at(shape_, t)))
    motion_.balance();
  holding_(motion_.driven().of_modes) = motion_.shape_force();
  reader_->read(motion_.q(), motion_.workspace(), &holding_, values_.data());
  return true;
}

template <class Space>
ActuatorReader<Space>::ActuatorReader(DrivenMechanism<Space> driven, VectorXd limit, std::vector<LinkPatches> patches)
    : driven_(std::move(driven)), motors_(driven_), limit_(std::move(limit)), patches_(std::move(patches)) {}

template <class Space> Index ActuatorReader<Space>::count() const {
  Index found = limit_.size();
  for (const LinkPatches &of_link : patches_)
    found += of_link.allocation.Phi().cols();
  return found;
}

template <class Space>
void ActuatorReader<Space>::read(const double *q, const Workspace<Space, double> &w, const VectorXd *shape,
                                 double *to) {
  motors_.resolve(q, w.lambda.data(), w);
  for (Index k = 0; k < limit_.size(); ++k)
    *to++ = std::clamp(motors_.tau()[k], -limit_[k], limit_[k]);
  modal_ = motors_.left();
  if (shape)
    modal_ += *shape;
  for (auto &[first, reached, allocation] : patches_) {
    reached_.resize(reached.rows());
    multiply_small(reached, modal_.data() + first, reached_.data());
    const VectorXd &V = allocation.solve(reached_);
    to = std::copy_n(V.data(), V.size(), to);
  }
}

template <class Space>
void PathReader<Space>::read(const double *, const Workspace<Space, double> &w, const VectorXd *, double *to) {
  std::fill_n(to, count_, 0.0);
  for (const auto &[row, column, sign] : parts_) {
    const Constraint &of = mechanism_.constraints[row];
    const double size = -sign * w.lambda[row];
    if (of.model.kind == ConstraintKind::coordinate) {
      to[column] += size;
      continue;
    }
    ConstraintMotion<double> motion;
    constraint_motion(of, w, of.moves, motion);
    Map<Vector3d> force(to + column), moment(to + column + 3);
    force += size * axes_ * Map<const Vector3d>(motion.force);
    moment += size * axes_ * Map<const Vector3d>(sign > 0 ? motion.moment_b : motion.moment_a);
  }
}

Index PointReader::count() const {
  Index found = 0;
  for (const PointComponents &of_body : bodies_)
    found += 3 * of_body.direction.cols();
  return found;
}

namespace {

MatrixXd L_a(const PointComponents &of, const Ref<const VectorXd> &p) {
  MatrixXd found(6 + p.size(), of.direction.cols());
  for (Index k = 0; k < found.cols(); ++k) {
    const ConstMatrix Phi = of.Phi.middleRows<3>(3 * k);
    const Vector3d e = of.direction.col(k), u = of.position.col(k) + matrix_product(Phi, p);
    found.col(k) << e, u.cross(e), VectorXd::Zero(p.size());
    add_transposed_product(Phi, e, found.col(k).tail(p.size()));
  }
  return found;
}

} // namespace

void PointReader::read(const double *q, const Workspace<Spatial, double> &w, const VectorXd *shape, double *to) {
  const std::vector<VectorXd> on_bodies = path_.path_forces_on_bodies(w.lambda.data(), w);
  for (const PointComponents &of : bodies_) {
    const std::size_t i = of.node;
    const auto &node = mechanism_.nodes[i];
    const Map<const VectorXd> p(q + node.p_q(), node.n());
    LeastNorm solver;
    solver.compute(of.scale.asDiagonal() * L_a(of, p));
    VectorXd Q_a = on_bodies[i];
    const Vector3d on_frame = Q_a.head<3>(), about_frame = Q_a.segment<3>(3);
    Q_a.head<3>() = of.axes.transpose() * on_frame;
    Q_a.segment<3>(3) = of.axes.transpose() * (about_frame - of.origin.cross(on_frame));
    if (shape)
      Q_a.tail(node.n()) += shape->segment(node.p_v(), node.n());
    Q_a.array() *= of.scale.array();
    const VectorXd force = solver.solve(Q_a);
    for (Index k = 0; k < force.size(); ++k, to += 3) {
      const Vector3d local = of.axes * (force[k] * of.direction.col(k));
      turn(w.bodies[i].absolute, local.data(), to);
    }
  }
}

template class RecordedForces<Planar>;
template class RecordedForces<Spatial>;
template class PrescribedForces<Planar>;
template class PrescribedForces<Spatial>;
template class ActuatorReader<Planar>;
template class ActuatorReader<Spatial>;
template class PathReader<Planar>;
template class PathReader<Spatial>;

} // namespace ffrobot::recursion
