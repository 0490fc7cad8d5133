// A sampled controller about an integration: states are read at samples, and commands held in between.
#pragma once

#include "core/integrate/integrate.h"

namespace ffrobot {

struct Sampling {
  std::vector<double> times; // s, of samples
  double delay = 0;          // s, from a sample to when its command acts
  // Command at sample k: time and state (q, v), under the command that acts; never asked about time beyond the run
  std::function<VectorXd(std::size_t, double, const double *)> controller;
  std::function<void(const VectorXd &)> hold; // a command, from now on
};

// Samples, and the actions of their commands, in order, of a run until `end` (s); what lies closer together than a
// clock tells is at one time. The sampling must outlive them.
inline Breaks sampled_breaks(const Sampling &sampling, double end) {
  struct Event {
    std::size_t sample;
    bool acts; // its command, which is taken otherwise
  };
  std::vector<Event> events;
  Breaks breaks;
  const auto &times = sampling.times;
  const double same = 1e-9 * (times.size() > 1 ? times[1] - times[0] : end);
  std::size_t acted = 0;
  const auto act_until = [&](double t, std::size_t taken) {
    for (; acted < taken && times[acted] + sampling.delay <= t + same; ++acted) {
      const double then = times[acted] + sampling.delay;
      breaks.times.push_back(then < t - same ? then : t), events.push_back({acted, true});
    }
  };
  for (std::size_t k = 0; k < times.size(); ++k) {
    act_until(times[k], k);
    breaks.times.push_back(times[k]), events.push_back({k, false});
    if (sampling.delay == 0)
      act_until(times[k], k + 1);
  }
  act_until(end, times.size());
  breaks.at = [&sampling, events, commands = std::vector<VectorXd>(times.size())](std::size_t i, double t,
                                                                                  const double *y) mutable {
    if (const auto &[sample, acts] = events[i]; acts)
      sampling.hold(commands[sample]);
    else
      commands[sample] = sampling.controller(sample, t, y);
  };
  return breaks;
}

} // namespace ffrobot
