// A motion under a sampled controller: sensors are read at samples, commands are held in between.
#pragma once

#include "core/actuation/external_loads.h"
#include "core/integrate/sampled_loop.h"
#include "core/system/system.h"

#include <functional>
#include <utility>
#include <vector>

namespace ffrobot {

// What sensors read of a state: the motion along rows and modal coordinates, or their derivatives of an order.
class Sensing {
public:
  struct AlongRow {
    Measure row;
    int order; // 0 value, 1 rate, 2 acceleration
  };
  struct OfModes {
    std::size_t body;
    Eigen::VectorXd vector; // reading = vector . p, p of the body, and of those after it where the vector is longer
    int order;              // 0 or 1
  };

  Sensing(const System &system, std::vector<AlongRow> rows, std::vector<OfModes> modes);

  Eigen::Index count() const { return readings_.size(); }

  // Readings (count), rows first, of (q, v) with accelerations a, which only sensors of order 2 need.
  const Eigen::VectorXd &read(const double *q, const double *v, const double *a);
  bool needs_accelerations() const { return needs_accelerations_; }

private:
  const System &system_;
  std::vector<AlongRow> rows_;
  std::vector<OfModes> modes_;
  Workspace workspace_;
  Eigen::VectorXd readings_;
  bool needs_accelerations_ = false;
};

// Motor forces on the first drives, in their order, and voltages of patches, all as they were last set.
class HeldCommands final : public ExternalLoads {
public:
  // body, Phi_V (n, k): n modes of that body, or of it and those after it
  using Patches = std::pair<std::size_t, Eigen::MatrixXd>;

  HeldCommands(std::size_t motors, std::vector<Patches> patches);

  // u: motors, then the patches of one body after the other.
  void set(const Eigen::VectorXd &u);
  void apply(double t, ExternalForces &forces) override;

private:
  std::vector<double> drive_;
  std::vector<Patches> patches_;
  std::vector<Eigen::VectorXd> modal_; // of each entry of patches_
};

// A system under held commands, as a sampled loop sees it.
class HeldPlant final : public SampledPlant {
public:
  struct Observed {
    const double *q, *v, *a; // of the system; accelerations where the sensors need them
  };
  using Observe = std::function<Observed(double, const double *)>; // at a time and a state of what is integrated

  HeldPlant(HeldCommands &commands, Sensing &sensing, Observe observe)
      : commands_(commands), sensing_(sensing), observe_(std::move(observe)) {}

  void hold(const Eigen::VectorXd &u) override { commands_.set(u); }
  Eigen::VectorXd read(double t, const double *y) override {
    const auto [q, v, a] = observe_(t, y);
    return sensing_.read(q, v, a);
  }

private:
  HeldCommands &commands_;
  Sensing &sensing_;
  Observe observe_;
};

} // namespace ffrobot
