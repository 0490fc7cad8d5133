#include "core/integrate/sampled_loop.h"

namespace ffrobot {

// Samples, and the actions of their commands, in order; what lies closer together than a clock tells is at one time.
std::vector<SampledLoop::Event> SampledLoop::schedule(const Sampling &sampling, double end) {
  std::vector<Event> events;
  const auto &times = sampling.times;
  const double same = 1e-9 * (times.size() > 1 ? times[1] - times[0] : end);
  std::size_t acted = 0;
  const auto act_until = [&](double t, std::size_t taken) {
    for (; acted < taken && times[acted] + sampling.delay <= t + same; ++acted) {
      const double then = times[acted] + sampling.delay;
      events.push_back({then < t - same ? then : t, acted, true});
    }
  };
  for (std::size_t k = 0; k < times.size(); ++k) {
    act_until(times[k], k);
    events.push_back({times[k], k, false});
    if (sampling.delay == 0)
      act_until(times[k], k + 1);
  }
  act_until(end, times.size());
  return events;
}

SampledLoop::SampledLoop(SampledPlant &plant, const Sampling &sampling, double end)
    : events_(schedule(sampling, end)), taken_(sampling.times.size()) {
  for (const Event &event : events_)
    breaks_.times.push_back(event.time);
  breaks_.at = [this, &plant, &sampling](std::size_t i, double t, const double *state) {
    const Event &event = events_[i];
    if (event.acts)
      plant.hold(taken_[event.sample]);
    else
      taken_[event.sample] = sampling.controller(event.sample, t, plant.read(t, state));
  };
}

} // namespace ffrobot
