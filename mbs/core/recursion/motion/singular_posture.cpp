#include "core/recursion/motion/singular_posture.h"

#include "core/recursion/motion/mobility.h"

#include <algorithm>

namespace ffrobot::recursion {

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

template void look(const PostureWatch &, double, const double *, Workspace<Planar, double> &, PostureHistory &);
template void look(const PostureWatch &, double, const double *, Workspace<Spatial, double> &, PostureHistory &);

} // namespace ffrobot::recursion
