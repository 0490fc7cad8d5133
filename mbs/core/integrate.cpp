#include "core/integrate.h"

#include <algorithm>
#include <cmath>

namespace ffrobot {

namespace {

// Step control of Hairer, Norsett, Wanner (1993), sec. II.4: elementary, with the usual safety factor and limits.
constexpr double safety = 0.9, smallest_factor = 0.2, largest_factor = 6.0;
constexpr unsigned long steps_between_questions = 1000;

double step_factor(double error) {
  if (!std::isfinite(error))
    return smallest_factor;
  return std::clamp(safety * std::pow(std::max(error, 1e-30), -1.0 / Dop853::error_order), smallest_factor,
                    largest_factor);
}

} // namespace

IntegrationReport integrate(OdeSystem &system, const std::vector<double> &times, Eigen::VectorXd &y,
                            const IntegrationControls &controls,
                            const std::function<void(std::size_t, double, const double *)> &output,
                            const std::function<bool(double)> &carry_on, Recording *recording) {
  Dop853 method(system.size());
  Eigen::VectorXd error(system.size()), y_output(system.size());
  const double end = times.back();
  IntegrationReport report;
  double t = times.front();
  double h = std::min(system.initial_step(), end - t);
  const auto record = [&] {
    if (recording) {
      recording->times.push_back(t);
      recording->states.insert(recording->states.end(), y.data(), y.data() + y.size());
    }
  };
  system.slope(t, y.data(), method.first_slope());
  system.accepted(t, y.data(), method.first_slope());
  record();
  output(report.outputs++, t, y.data());
  bool just_rejected = false;
  while (report.outputs < times.size()) {
    if (controls.max_steps && report.steps + report.rejected >= controls.max_steps) {
      report.status = IntegrationStatus::too_many_steps;
      break;
    }
    if ((report.steps + report.rejected) % steps_between_questions == 0 && !carry_on(t)) {
      report.status = IntegrationStatus::interrupted;
      break;
    }
    const double left = end - t;
    if (h < 1e-13 * std::max(std::abs(t), left)) {
      report.status = IntegrationStatus::step_underflow;
      break;
    }
    // no sliver of a last step
    const bool last = h >= left;
    const double step = last ? left : (h > 0.5 * left ? 0.5 * left : h);
    const double t_end = last ? end : t + step;
    method.step(system, t, y.data(), step);
    double size = NAN;
    if (system.correct(t_end, method.end())) {
      system.slope(t_end, method.end(), method.last_slope());
      const double damping = method.estimate(step, error);
      size = system.error_size(t_end, method.end(), error.data()) * damping / controls.tolerance;
    }
    if (!(size <= 1)) {
      ++report.rejected;
      just_rejected = true;
      h = step * std::min(step_factor(size), 0.9);
      continue;
    }
    ++report.steps;
    bool dense = false;
    for (; report.outputs < times.size() && times[report.outputs] <= t_end; ++report.outputs) {
      if (times[report.outputs] == t_end) {
        output(report.outputs, t_end, method.end());
        continue;
      }
      if (!dense)
        method.prepare_dense(system, t, y.data(), step);
      dense = true;
      method.interpolate(times[report.outputs], y_output.data());
      output(report.outputs, times[report.outputs], y_output.data());
    }
    t = t_end;
    y = Eigen::Map<const Eigen::VectorXd>(method.end(), system.size());
    std::copy_n(method.last_slope(), system.size(), method.first_slope());
    system.accepted(t, y.data(), method.first_slope());
    record();
    const double factor = step_factor(size);
    h = step * (just_rejected ? std::min(factor, 1.0) : factor);
    just_rejected = false;
  }
  report.time = t;
  report.evaluations = system.evaluations();
  return report;
}

} // namespace ffrobot
