#include "core/recursion/motion/loop_watch.h"

#include "core/linear/dense.h"
#include "core/recursion/motion/postures.h"

namespace ffrobot::recursion {

namespace {

// Of the volume of regular constraints. At such a distance from a singular posture, relative to one radian, branches
// are this distance apart, and constraints tell them apart by its square: by more than the 1e-12 to which projections
// keep them.
constexpr double next_to_singular = 1e-5;

// sqrt(det C M^-1 C^T) of the active constraints, from its factors
template <class Space> double volume(const Workspace<Space, double> &w) {
  const std::size_t next = w.factored() + 1; // on the diagonal
  double inverse = 1;
  for (std::size_t r = 0; r < w.active.size(); ++r)
    inverse *= w.factor[r * next];
  return 1 / std::sqrt(inverse);
}

} // namespace

template <class Space>
LoopWatch<Space>::LoopWatch(const Workspace<Space, double> &w)
    : multiplier_(VectorXd::Zero(w.m.constraints.size())), answer_(w.m.n_v), volume_(volume(w)),
      least_volume_(next_to_singular * volume_) {}

template <class Space>
void LoopWatch<Space>::begin_at(const double *q, const Workspace<Space, double> &w, Workspace<Space, double> &other) {
  C_0_ = gradients(q, other)(w.active, Eigen::all);
  product_.resize(C_0_.rows(), C_0_.rows());
  volume_ = volume(w), cosine_ = 1;
}

template <class Space> double LoopWatch<Space>::cosine(const double *q, Workspace<Space, double> &w) {
  const double now = volume(w);
  if (!(now > least_volume_))
    return cosine_ = 0;
  for (std::size_t k = 0; k < w.active.size(); ++k) {
    multiplier_[w.active[k]] = 1;
    respond(q, multiplier_.data(), w, answer_.data()); // -M^-1 C^T of one constraint
    multiplier_[w.active[k]] = 0;
    product_.col(k).noalias() = C_0_ * -answer_;
  }
  return cosine_ = determinant(product_) / (volume_ * now);
}

template <class Space> bool LoopWatch<Space>::is_poor(const Workspace<Space, double> &w) const {
  return volume(w) < 0.3 * volume_;
}

template class LoopWatch<Planar>;
template class LoopWatch<Spatial>;

} // namespace ffrobot::recursion
