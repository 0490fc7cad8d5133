#include "core/recursion/motion/postures.h"

#include "core/linear/dense.h"

namespace ffrobot::recursion {

using Times = std::vector<double>;

namespace {

// C_v at the state that `w` has
template <class Space>
MatrixXd gradients_there(const double *q, NewtonEuler<Space> &forces, Workspace<Space, double> &w) {
  const Index count = w.m.constraints.size();
  VectorXd unit = VectorXd::Zero(count), along(w.m.n_v);
  MatrixXd found(count, w.m.n_v);
  for (Index r = 0; r < count; ++r) {
    unit[r] = -1; // loads are of -lambda
    forces.load(unit.data(), nullptr, w);
    unit[r] = 0;
    forces.project(q, w, along.data());
    found.row(r) = along.transpose();
  }
  return found;
}

} // namespace

template <class Space> MatrixXd gradients(const double *q, Workspace<Space, double> &w) {
  place_all(q, VectorXd::Zero(w.m.n_v).eval().data(), nullptr, w);
  NewtonEuler<Space> forces(w.m);
  return gradients_there(q, forces, w);
}

template <class Space>
Postures<Space>::Postures(const Scene &scene, Workspace<Space, double> &w)
    : scene_(scene), w_(w), forces_(w.m), value_(w.m.constraints.size()), rate_(value_),
      still_(VectorXd::Zero(w.m.n_v)) {}

template <class Space> void Postures<Space>::go_to(double t) {
  turn_markers(scene_, t, w_);
  targets_ = targets_at(scene_, t);
}

template <class Space> void Postures<Space>::measure(const double *q, const double *v) {
  recursion::measure(q, v, w_, value_.data(), rate_.data());
  take_off(targets_, w_.m.constraints, value_, rate_);
}

template <class Space>
std::pair<RowMajor, RowMajor> Postures<Space>::constraints(const Times &times, const RowMajor &q) {
  RowMajor values(q.rows(), value_.size()), slopes(q.rows(), value_.size() * w_.m.n_v);
  for (Index i = 0; i < q.rows(); ++i) {
    const double *at = q.row(i).data();
    go_to(times[i]);
    measure(at, still_.data());
    values.row(i) = value_.transpose();
    Map<RowMajor>(slopes.row(i).data(), value_.size(), w_.m.n_v) = gradients_there(at, forces_, w_);
  }
  return {values, slopes};
}

template <class Space> RowMajor Postures<Space>::rates(const Times &times, const RowMajor &q, const RowMajor &v) {
  RowMajor found(q.rows(), rate_.size());
  for (Index i = 0; i < q.rows(); ++i) {
    go_to(times[i]);
    measure(q.row(i).data(), v.row(i).data());
    found.row(i) = rate_.transpose();
  }
  return found;
}

template <class Space>
std::pair<RowMajor, VectorXd> Postures<Space>::solve(const Times &times, RowMajor q, const RowMajor &beside,
                                                     const PostureSearch &search) {
  constexpr double tolerance = 1e-13, floor = 1e-12;
  const ConfigurationSpace space(w_.m.n_v, w_.m.rotations);
  LeastNorm factors;
  std::vector<Index> moving;
  for (Index k = 0; k < w_.m.n_v; ++k)
    if (search.scales[k] > 0)
      moving.push_back(k);
  const VectorXd scales = search.scales(moving);
  VectorXd step = still_, left = VectorXd::Zero(q.rows());
  for (Index i = 0; value_.size() && i < q.rows(); ++i) {
    go_to(times[i]);
    for (Index r = 0; beside.size() && r < value_.size(); ++r)
      targets_[r].value += beside(i, r);
    double *at = q.row(i).data();
    MatrixXd J;
    const auto off = [&] {
      measure(at, still_.data());
      value_.array() /= search.sizes.array();
      J = gradients_there(at, forces_, w_)(Eigen::all, moving);
      J.array().colwise() /= search.sizes.array();
      J.array().rowwise() *= scales.transpose().array();
      return J.allFinite() ? value_.template lpNorm<Eigen::Infinity>() : std::nan("");
    };
    const auto go = [&] {
      if (moving.empty())
        return;
      factors.compute(J, true);
      VectorXd moved = -factors.solve(value_);
      const double longest = moved.template lpNorm<Eigen::Infinity>();
      moved *= longest > search.largest_step ? search.largest_step / longest : 1;
      step(moving) = moved.cwiseProduct(scales);
      space.integrate(at, 1, step.data(), at);
    };
    left[i] = iterate_to_posture(tolerance, floor, off, go);
  }
  return {std::move(q), left};
}

template MatrixXd gradients(const double *, Workspace<Planar, double> &);
template MatrixXd gradients(const double *, Workspace<Spatial, double> &);
template class Postures<Planar>;
template class Postures<Spatial>;

} // namespace ffrobot::recursion
