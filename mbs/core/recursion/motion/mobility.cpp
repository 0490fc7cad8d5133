#include "core/recursion/motion/mobility.h"

#include "core/linear/dense.h"
#include "core/recursion/motion/natural_sizes.h"
#include "core/recursion/motion/postures.h"

namespace ffrobot::recursion {

namespace {

constexpr double singular = 1e-6; // of the largest singular value: ranks of equations

// Rates of constraints by the joints' velocities (constraints, joint coordinates), lengths in units of `length`
template <class Space> MatrixXd gradients_by_joints(double length, const double *q, Workspace<Space, double> &w) {
  std::vector<int> joints, ways;
  for (const Node<Space> &node : w.m.nodes)
    for (int k = 0; k < node.shape.freedoms.count; ++k) {
      if (node.shape.freedoms.component[k] < Space::linear)
        ways.push_back(static_cast<int>(joints.size()));
      joints.push_back(node.v + k);
    }
  MatrixXd J = gradients(q, w)(Eigen::all, joints);
  J(Eigen::all, ways) *= length;
  for (std::size_t r = 0; r < w.m.constraints.size(); ++r)
    if (!is_moment(w.m, w.m.constraints[r]))
      J.row(r) /= length;
  return J;
}

MatrixXd rows_of(const MatrixXd &J, const std::vector<char> &is_path, bool path) {
  std::vector<Index> chosen;
  for (std::size_t r = 0; r < is_path.size(); ++r)
    if ((is_path[r] != 0) == path)
      chosen.push_back(r);
  return J(chosen, Eigen::all);
}

} // namespace

double Mobility::determinant() const {
  return loops.values.size() || rates.rows() != rates.cols() ? 0 : ffrobot::determinant(rates);
}

Index Mobility::followed() const { return path.rank(singular); }

MatrixXd Mobility::left() const { return free * path.null_space(followed()); }

VectorXd Mobility::hardest() const {
  if (free.cols() == 0)
    return VectorXd::Zero(free.rows());
  return free * path.V.col(std::max<Index>(path.values.size(), 1) - 1);
}

template <class Space>
Mobility mobility(const PostureWatch &watch, const double *q, Workspace<Space, double> &w, Index loop_rank) {
  const MatrixXd J = gradients_by_joints(watch.length, q, w);
  RightVectors loops(rows_of(J, watch.is_path, false));
  const Index rank = loop_rank < 0 ? loops.rank(singular) : loop_rank;
  MatrixXd free = loops.null_space(rank), rates = rows_of(J, watch.is_path, true) * free;
  RightVectors path(rates);
  return {std::move(loops), rank, std::move(free), std::move(rates), std::move(path)};
}

template <class Space>
void look(const PostureWatch &watch, double t, const double *q, Workspace<Space, double> &w, PostureHistory &history) {
  double ratio = 1, determinant = 0, at = t;
  if (std::ranges::find(watch.is_path, 1) != watch.is_path.end()) {
    const Mobility found = mobility(watch, q, w);
    ratio = found.ratio(), determinant = found.determinant();
  }
  if (determinant * history.determinant < 0) { // between this posture and the last
    ratio = 0;
    at -= (t - history.watched_at) * determinant / (determinant - history.determinant);
  }
  history.determinant = determinant, history.watched_at = t;
  if (ratio < history.least_ratio) {
    history.least_ratio = ratio, history.singular_at = at;
    history.singular_posture = Map<const VectorXd>(q, w.m.n_q);
  }
}

template Mobility mobility(const PostureWatch &, const double *, Workspace<Planar, double> &, Index);
template Mobility mobility(const PostureWatch &, const double *, Workspace<Spatial, double> &, Index);
template void look(const PostureWatch &, double, const double *, Workspace<Planar, double> &, PostureHistory &);
template void look(const PostureWatch &, double, const double *, Workspace<Spatial, double> &, PostureHistory &);

} // namespace ffrobot::recursion
