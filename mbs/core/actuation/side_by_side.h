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

// Those of all bodies, `size` numbers.
inline Eigen::VectorXd joined(const std::vector<Eigen::VectorXd> &of_bodies, Eigen::Index size) {
  Eigen::VectorXd found(size);
  collect(of_bodies, 0, found);
  return found;
}

// The other way round of collect().
inline void distribute(const Eigen::VectorXd &joined, std::size_t first, std::vector<Eigen::VectorXd> &of_bodies) {
  for (Eigen::Index row = 0; row < joined.size(); ++first) {
    of_bodies[first] = joined.segment(row, of_bodies[first].size());
    row += of_bodies[first].size();
  }
}

} // namespace ffrobot
