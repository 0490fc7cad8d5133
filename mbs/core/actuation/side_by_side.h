// Modal vectors of consecutive bodies side by side, as those of a link in pieces.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace ffrobot {

// Fills `joined` with the vectors of the bodies from `first` on.
inline void collect(const std::vector<Eigen::VectorXd> &of_bodies, std::size_t first, Eigen::VectorXd &joined) {
  for (Eigen::Index row = 0; row < joined.size(); ++first) {
    joined.segment(row, of_bodies[first].size()) = of_bodies[first];
    row += of_bodies[first].size();
  }
}

// The other way round.
inline void distribute(const Eigen::VectorXd &joined, std::size_t first, std::vector<Eigen::VectorXd> &of_bodies) {
  for (Eigen::Index row = 0; row < joined.size(); ++first) {
    of_bodies[first] = joined.segment(row, of_bodies[first].size());
    row += of_bodies[first].size();
  }
}

} // namespace ffrobot
