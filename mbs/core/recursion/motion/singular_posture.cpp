#include "core/recursion/motion/singular_posture.h"

#include "core/recursion/motion/mobility.h"

#include <algorithm>

namespace ffrobot::recursion {

template <class Space>
Posture posture_at(const Mechanism<Space> &m, const PostureWatch &watch, const double *q, Workspace<Space, double> &w) {
  if (std::ranges::find(watch.is_path, 1) == watch.is_path.end())
    return {};
  const Mobility found = mobility(m, watch, q, w);
  return {found.ratio(), found.determinant()};
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
    history.singular_posture = Eigen::Map<const Eigen::VectorXd>(q, m.n_q);
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
