#include "core/analysis/sampled.h"

#include "core/actuation/side_by_side.h"

#include <algorithm>

namespace ffrobot {

using Eigen::Index;
using Eigen::VectorXd;
using VectorMap = Eigen::Map<const VectorXd>;

Sensing::Sensing(const System &system, std::vector<AlongRow> rows, std::vector<OfModes> modes)
    : system_(system), rows_(std::move(rows)), modes_(std::move(modes)), workspace_(system),
      readings_(VectorXd::Zero(static_cast<Index>(rows_.size() + modes_.size()))) {
  for (const auto &sensor : rows_)
    needs_accelerations_ |= sensor.order == 2;
}

const VectorXd &Sensing::read(const double *q, const double *v, const double *a) {
  update_kinematics(system_, q, v, workspace_);
  Index i = 0;
  MeasureMotion motion;
  for (const auto &[row, order] : rows_) {
    evaluate(row, workspace_.bodies, motion);
    readings_[i++] = order == 0   ? motion.value
                     : order == 1 ? motion.rate
                                  : row_acceleration(system_, row, motion, a, workspace_);
  }
  for (const auto &[first, vector, order] : modes_) {
    double reading = 0;
    std::size_t body = first;
    for (Index row = 0; row < vector.size(); ++body) {
      const Index n = system_.bodies[body].modes();
      const VectorMap p((order == 0 ? q : v) + system_.first_coordinate[body] + 3, n);
      reading += vector.segment(row, n).dot(p);
      row += n;
    }
    readings_[i++] = reading;
  }
  return readings_;
}

HeldCommands::HeldCommands(std::size_t motors, std::vector<Patches> patches)
    : drive_(motors, 0.0), patches_(std::move(patches)) {
  for (const auto &[body, Phi_V] : patches_)
    modal_.emplace_back(VectorXd::Zero(Phi_V.rows()));
}

void HeldCommands::set(const VectorXd &u) {
  std::copy_n(u.data(), drive_.size(), drive_.begin());
  auto first = static_cast<Index>(drive_.size());
  for (std::size_t i = 0; i < patches_.size(); ++i) {
    const auto &Phi_V = patches_[i].second;
    modal_[i].noalias() = Phi_V * u.segment(first, Phi_V.cols());
    first += Phi_V.cols();
  }
}

void HeldCommands::apply(double, ExternalForces &forces) {
  std::copy(drive_.begin(), drive_.end(), forces.drive.begin());
  forces.has_modal = !patches_.empty();
  for (std::size_t i = 0; i < patches_.size(); ++i)
    distribute(modal_[i], patches_[i].first, forces.modal);
}

} // namespace ffrobot
