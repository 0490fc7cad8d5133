#include "core/recursion/motion/singular_posture.h"

#include "core/linear/singular_values.h"
#include "core/recursion/inverse/postures.h"
#include "core/recursion/motion/natural_sizes.h"

#include <Eigen/LU>

#include <algorithm>

namespace ffrobot::recursion {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double singular = 1e-10; // of the largest singular value: rank of the loops' constraints

// Rates of constraints by the joints' velocities (constraints, joint coordinates), lengths in units of `length`
template <class Space>
MatrixXd gradients_by_joints(const Mechanism<Space> &m, double length, const double *q, Workspace<Space, double> &w) {
  std::vector<int> joints, ways;
  for (const Node<Space> &node : m.nodes)
    for (int k = 0; k < node.shape.freedoms.count; ++k) {
      if (node.shape.freedoms.component[k] < Space::linear)
        ways.push_back(static_cast<int>(joints.size()));
      joints.push_back(node.v + k);
    }
  MatrixXd J = gradients(m, q, w)(Eigen::all, joints);
  J(Eigen::all, ways) *= length;
  for (std::size_t r = 0; r < m.constraints.size(); ++r)
    if (!is_moment(m, m.constraints[r]))
      J.row(static_cast<Index>(r)) /= length;
  return J;
}

MatrixXd rows_of(const MatrixXd &J, const std::vector<char> &is_path, bool path) {
  std::vector<Index> chosen;
  for (std::size_t r = 0; r < is_path.size(); ++r)
    if ((is_path[r] != 0) == path)
      chosen.push_back(static_cast<Index>(r));
  return J(chosen, Eigen::all);
}

} // namespace

template <class Space>
Posture posture_at(const Mechanism<Space> &m, const PostureWatch &watch, const double *q, Workspace<Space, double> &w) {
  if (std::none_of(watch.is_path.begin(), watch.is_path.end(), [](char is_path) { return is_path; }))
    return {};
  MatrixXd followed = gradients_by_joints(m, watch.length, q, w);
  const bool has_loops = !std::all_of(watch.is_path.begin(), watch.is_path.end(), [](char is_path) { return is_path; });
  if (has_loops) {
    const MatrixXd loops = rows_of(followed, watch.is_path, false);
    followed = rows_of(followed, watch.is_path, true) * null_space(loops, singular);
  }
  if (followed.rows() > followed.cols())
    return {0, 0};
  const VectorXd values = singular_values(followed);
  Posture found;
  found.ratio = values[0] > 0 ? values[values.size() - 1] / values[0] : 0;
  if (!has_loops && followed.rows() == followed.cols()) // else the basis of freedoms has no sign
    found.determinant = followed.determinant();
  return found;
}

template <class Space>
void look(const Mechanism<Space> &m, const PostureWatch &watch, double t, const double *q, Workspace<Space, double> &w,
          PostureHistory &history) {
  Posture posture = posture_at(m, watch, q, w);
  double at = t;
  if (posture.determinant * history.determinant < 0) { // between this posture and the last
    posture.ratio = 0;
    at -= (t - history.watched_at) * posture.determinant / (posture.determinant - history.determinant);
  }
  history.determinant = posture.determinant, history.watched_at = t;
  if (posture.ratio < history.least_ratio) {
    history.least_ratio = posture.ratio, history.singular_at = at;
    history.singular_posture = Eigen::Map<const VectorXd>(q, m.n_q);
  }
}

template Posture posture_at(const Mechanism<Planar> &, const PostureWatch &, const double *,
                            Workspace<Planar, double> &);
template Posture posture_at(const Mechanism<Spatial> &, const PostureWatch &, const double *,
                            Workspace<Spatial, double> &);
template void look(const Mechanism<Planar> &, const PostureWatch &, double, const double *, Workspace<Planar, double> &,
                   PostureHistory &);
template void look(const Mechanism<Spatial> &, const PostureWatch &, double, const double *,
                   Workspace<Spatial, double> &, PostureHistory &);

} // namespace ffrobot::recursion
