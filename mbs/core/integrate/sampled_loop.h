// A sampled controller about an integration: what it acts on is read at samples, and holds commands in between.
#pragma once

#include "core/integrate/integrate.h"

#include <functional>
#include <vector>

namespace ffrobot {

// What a sampled loop asks of a motion, of whatever model.
class SampledPlant {
public:
  virtual ~SampledPlant() = default;
  virtual Eigen::VectorXd read(double t, const double *y) = 0; // at a state y = (q, v), under the command that acts
  virtual void hold(const Eigen::VectorXd &u) = 0;             // from now on
};

struct Sampling {
  std::vector<double> times;
  double delay = 0; // from a sample to when its command acts
  // u for what was read at sample k; never asked about time beyond the run
  std::function<Eigen::VectorXd(std::size_t, double, const Eigen::VectorXd &)> controller;
};

class SampledLoop {
public:
  // For a run until `end`. Plant and sampling must outlive this.
  SampledLoop(SampledPlant &plant, const Sampling &sampling, double end);
  SampledLoop(const SampledLoop &) = delete;
  SampledLoop &operator=(const SampledLoop &) = delete;

  const Breaks &breaks() const { return breaks_; }

private:
  struct Event {
    double time;
    std::size_t sample;
    bool acts; // the command of the sample, which is taken otherwise
  };

  static std::vector<Event> schedule(const Sampling &sampling, double end);

  std::vector<Event> events_;
  std::vector<Eigen::VectorXd> taken_;
  Breaks breaks_;
};

} // namespace ffrobot
