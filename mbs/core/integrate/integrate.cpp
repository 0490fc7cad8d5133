#include "core/integrate/integrate.h"

#include "core/integrate/step_control.h"

#include <algorithm>
#include <chrono>
#include <cmath>

namespace ffrobot {

namespace {

constexpr unsigned long steps_between_questions = 1000;
constexpr std::chrono::milliseconds time_between_questions{200}; // where steps take long

// A step size that collapses never quite reaches rounding where noise feeds its estimates. A run that would take this
// many times the steps it is allowed, at the pace of its last thousand, is not worth going on with.
constexpr double hopeless = 100;

// What is an error once, not at every step, may take from a reserve, all of which is as much as the tolerance. A load
// that jumps leaves an error in proportion to the step across it, more than that step's share of the tolerance however
// short it is: steps that have become so much shorter than those before may take from the reserve. Vibrations below the
// tolerance that a step damps away are gone after it: methods that do so begin with the longest step there is, and may.
constexpr double much_shorter = 1e-3, part_of_reserve = 0.25;

// Size of the next step: no sliver before `left`, or, where the method lands there, equal parts of the way.
double next_step(double h, double left, bool lands) {
  if (h >= left)
    return left;
  if (lands)
    return left / std::ceil(left / h);
  return h > 0.5 * left ? 0.5 * left : h;
}

} // namespace

IntegrationReport integrate(ImplicitSystem &system, const std::vector<double> &times, Eigen::VectorXd &y,
                            const IntegrationControls &controls,
                            const std::function<void(std::size_t, double, const double *)> &output,
                            const std::function<bool(double)> &carry_on, Recording *recording, const Breaks *breaks,
                            Checkpoint *checkpoint) {
  const auto made = make_method(controls.method, system);
  Method &method = *made;
  Eigen::VectorXd error(system.size()), y_output(system.size());
  const double end = times.back(), duration = end - times.front();
  IntegrationReport report;
  double t = times.front(), t_asked = t;
  auto asked = std::chrono::steady_clock::now();
  double usual_step = 0, reserve = 1; // the largest of late; in terms of the tolerance
  bool in_transient = method.damps(); // vibrations of the start
  double h = method.damps() ? end - t : std::min(system.initial_step(), end - t);
  const auto record = [&] {
    if (recording) {
      recording->times.push_back(t);
      recording->states.insert(recording->states.end(), y.data(), y.data() + y.size());
    }
  };
  std::size_t next_break = 0;
  const auto pass_breaks = [&] {
    const std::size_t before = next_break;
    while (breaks && next_break < breaks->times.size() && breaks->times[next_break] <= t) {
      breaks->at(next_break, t, y.data());
      ++next_break;
    }
    return next_break > before;
  };
  pass_breaks();
  StepControl control(method.error_order());
  if (checkpoint && checkpoint->state.size()) {
    y = checkpoint->state;
    t = t_asked = checkpoint->time;
    h = checkpoint->stepping[0];
    usual_step = checkpoint->stepping[1];
    reserve = checkpoint->stepping[2];
    control.go_on(checkpoint->stepping[3], checkpoint->stepping[4]);
    in_transient = checkpoint->stepping[5] != 0;
    system.restore(checkpoint->gathered);
    system.slope(t, y.data(), method.first_slope());
    report.outputs = checkpoint->outputs;
  } else {
    system.slope(t, y.data(), method.first_slope());
    system.accepted(t, y.data(), method.first_slope());
    record();
    output(report.outputs++, t, y.data());
  }
  if (recording) {
    recording->method = controls.method;
    recording->tolerance = controls.tolerance;
  }
  while (report.outputs < times.size()) {
    if (controls.max_steps && report.steps + report.rejected >= controls.max_steps) {
      report.status = IntegrationStatus::too_many_steps;
      break;
    }
    const double left = end - t;
    bool collapsed = h < 1e-13 * std::max(std::abs(t), left);
    if (const auto taken = report.steps + report.rejected; taken % steps_between_questions == 0) {
      if (!carry_on(t)) {
        report.status = IntegrationStatus::interrupted;
        break;
      }
      const double most = hopeless * static_cast<double>(controls.max_steps) / steps_between_questions;
      collapsed = collapsed || (taken > 0 && controls.max_steps && left > most * (t - t_asked));
      t_asked = t;
      asked = std::chrono::steady_clock::now();
    } else if (const auto now = std::chrono::steady_clock::now(); now - asked > time_between_questions) {
      asked = now;
      if (!carry_on(t)) {
        report.status = IntegrationStatus::interrupted;
        break;
      }
    }
    if (collapsed) {
      report.status = IntegrationStatus::step_underflow;
      break;
    }
    h = std::min(h, duration);
    double target = method.lands_on_outputs() ? times[report.outputs] : end;
    bool lands = method.lands_on_outputs();
    if (breaks && next_break < breaks->times.size() && breaks->times[next_break] <= target) {
      target = breaks->times[next_break];
      lands = true;
    }
    const double step = next_step(h, target - t, lands);
    const double t_end = step == target - t ? target : t + step;
    constexpr double rounding = 2e-14; // what estimates see of it: shorter steps would not help
    const double regular = method.error_share(step / duration);
    const bool once = in_transient || step < much_shorter * usual_step;
    const double part = once ? std::max(regular, part_of_reserve * reserve) : regular;
    const double share = std::max(controls.tolerance * part, rounding);
    const double regular_share = std::max(controls.tolerance * regular, rounding);
    double size = NAN;
    if (method.step(t, y.data(), step, in_transient ? regular_share : share) && method.correct(t_end)) {
      system.slope(t_end, method.end(), method.last_slope());
      const double damping = method.estimate(step, error);
      size = system.error_size(t_end, method.end(), error.data()) * damping / share;
    }
    if (!(size <= 1)) {
      ++report.rejected;
      h = control.after_rejected(step, size);
      continue;
    }
    ++report.steps;
    usual_step = std::max(step, 0.8 * usual_step);
    if (part > regular && (!in_transient || size * share > regular_share))
      reserve -= size * part;
    if (in_transient) {
      size *= share / regular_share; // the steps after this one should do without the reserve
      in_transient = size > 1;
    }
    bool dense = false;
    for (; report.outputs < times.size() && times[report.outputs] <= t_end; ++report.outputs) {
      if (times[report.outputs] == t_end) {
        output(report.outputs, t_end, method.end());
        continue;
      }
      if (!dense)
        method.prepare_dense(t, y.data(), step);
      dense = true;
      method.interpolate(times[report.outputs], y_output.data());
      output(report.outputs, times[report.outputs], y_output.data());
    }
    t = t_end;
    method.accept(step);
    y = Eigen::Map<const Eigen::VectorXd>(method.end(), system.size());
    std::copy_n(method.last_slope(), system.size(), method.first_slope());
    system.accepted(t, y.data(), method.first_slope());
    record();
    if (!system.is_sensible(y.data())) {
      report.status = IntegrationStatus::diverged;
      break;
    }
    // Steps that were shortened to land on an output tell what the step asked for would have cost.
    // A much shorter one, on the way to a break, tells nothing: what was found before it stands.
    const double asked = std::clamp(h, step, 2 * step);
    if (!(t == target && breaks && 2 * step < h))
      h = control.after_accepted(asked, size * std::pow(asked / step, method.error_order()));
    if (pass_breaks()) {
      system.slope(t, y.data(), method.first_slope());
      method.restart();
    }
  }
  if (checkpoint) {
    Eigen::VectorXd stepping(6);
    stepping << h, usual_step, reserve, control.previous_step(), control.previous_error(), in_transient;
    *checkpoint = {t, y, stepping, system.save(), report.outputs};
  }
  report.time = t;
  report.evaluations = system.evaluations();
  return report;
}

} // namespace ffrobot
