#include "core/integrate.h"

#include <algorithm>
#include <cmath>

namespace ffrobot {

namespace {

constexpr double order = Dop853::error_order;
constexpr double target = 0.25; // of the largest error allowed: leaves room for its scatter from step to step
constexpr unsigned long steps_between_questions = 1000;

// Step control by the digital filter H211b, b = 8 (G. Soderlind, ACM Trans. Math. Softw. 29, 2003): the elementary
// controller rejects every third step where fast vibration makes the error scatter.
class StepControl {
public:
  double after_accepted(double step, double error) {
    constexpr double b = 8, exponent = 1 / (b * order);
    error = std::max(error, 1e-12);
    double factor = std::pow(target / error, exponent);
    factor *= previous_step_ > 0
                  ? std::pow(target / previous_error_, exponent) * std::pow(step / previous_step_, -1 / b)
                  : factor;
    previous_step_ = step;
    previous_error_ = error;
    return step * (1 + std::atan(factor - 1));
  }

  static double after_rejected(double step, double error) {
    constexpr double smallest_factor = 0.2, largest_factor = 0.9;
    if (!std::isfinite(error))
      return step * smallest_factor;
    return step * std::clamp(std::pow(target / error, 1 / order), smallest_factor, largest_factor);
  }

private:
  double previous_step_ = 0, previous_error_ = 1;
};

} // namespace

IntegrationReport integrate(OdeSystem &system, const std::vector<double> &times, Eigen::VectorXd &y,
                            const IntegrationControls &controls,
                            const std::function<void(std::size_t, double, const double *)> &output,
                            const std::function<bool(double)> &carry_on, Recording *recording) {
  Dop853 method(system.size());
  Eigen::VectorXd error(system.size()), y_output(system.size());
  const double end = times.back(), duration = end - times.front();
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
  StepControl control;
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
      // Errors of single steps add up like a random walk, so a step's share of the tolerance is sqrt(step / duration);
      // `accumulation` is how far the sum exceeds that (tests/benchmarks, error against tolerance).
      constexpr double accumulation = 8;
      constexpr double rounding = 2e-14; // what the estimate sees of it: shorter steps would not help
      const double share = std::max(controls.tolerance / accumulation * std::sqrt(step / duration), rounding);
      size = system.error_size(t_end, method.end(), error.data()) * damping / share;
    }
    if (!(size <= 1)) {
      ++report.rejected;
      h = StepControl::after_rejected(step, size);
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
    h = control.after_accepted(step, size);
  }
  report.time = t;
  report.evaluations = system.evaluations();
  return report;
}

} // namespace ffrobot
