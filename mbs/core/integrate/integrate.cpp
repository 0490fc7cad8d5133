#include "core/integrate/integrate.h"

#include "core/integrate/delivery.h"
#include "core/integrate/jump.h"
#include "core/integrate/rounding.h"
#include "core/integrate/step_limit.h"
#include "core/integrate/watch.h"

#include <iterator>
#include <stdexcept>

namespace ffrobot {

namespace {

// What is judged of dense output: steps of this many radians of the fastest vibration are too long for it. Their
// estimates hardly see it, and most harm is done between their ends. Only where it may be a notable part of the
// tolerance.
constexpr double radians_too_long = 5, notable = 0.1;

// Steps below a radian of the fastest vibration, in first steps, are looked at for rounding: vibrations do not ask for
// steps that are much shorter. Of methods that damp what they do not resolve all steps are.
constexpr double radian = 10;

// Rounding of a single step beyond this part of the peaks is none that a run could go on with: steps that collapse say
// so.
constexpr double hopeless = 0.1;

// Rounding of one step may be so many times that of another: each is one draw.
constexpr double scatter = 3;

// Steps that are rejected until they are this part of the usual ones may have met a jump, which is looked for. Steps
// end before it and begin behind it, and are as long as usual.
constexpr double may_have_met_jump = 0.1;

// Steps turn orientations by no more than that (rad), below half a turn: see LocalCoordinates.
constexpr double most_turn = 3;

// Length of the next step: no sliver before `left`, or, where the method lands there, equal parts of the way.
double next_step(double h, double left, bool lands) {
  if (h >= left)
    return left;
  if (lands)
    return left / std::ceil(left / h);
  return h > 0.5 * left ? 0.5 * left : h;
}

// A step to be tried. `target` is where steps have to end next, if `lands`, or the end of the run.
struct Attempt {
  double target, step, end;
  bool is_limited; // shorter than asked for, by what is prescribed
};

class Integration {
public:
  Integration(OdeSystem &system, const std::vector<double> &times, const VectorXd &y,
              const IntegrationControls &controls, const StateFunctionOfTime &output,
              const std::function<bool(double)> &carry_on, const Companions &with)
      : system_(system), controls_(controls), breaks_(with.breaks), limit_watch_(with.limits),
        delivery_(system, times, output, with.recording, with.samples),
        watch_(system, times.front(), times.back(), controls.max_steps, carry_on),
        step_limit_(system, times.front(), times.back(), controls.tolerance),
        methods_(controls.methods, times.front(), times.back()), method_(make_method(methods_.at_work(), system)),
        control_(method_->error_order()), t_(times.front()), end_(times.back()),
        duration_(times.back() - times.front()), rounding_(system), z_(system.size()), error_(system.size()) {
    is_repeatable_ = !breaks_ && !method_->lands_on_outputs();
    system_.local().set_centre(y.data());
    system_.local().from_state(y.data(), z_.data());
  }

  void begin() {
    pass_breaks();
    begin_method();
    system_.accepted(t_, z_.data(), method_->first_slope());
    delivery_.record(t_, z_.data());
    delivery_.record_method(methods_.at_work());
    delivery_.sample(t_, z_.data());
    delivery_.output(z_.data());
    if (limit_watch_)
      limit_watch_->begin(t_, z_.data());
  }

  void go_on(const IntegrationCheckpoint &checkpoint) {
    pass_breaks(); // those at the start
    system_.local().set_centre(checkpoint.state.data());
    system_.local().from_state(checkpoint.state.data(), z_.data());
    t_ = checkpoint.time;
    watch_.begin_at(t_);
    methods_.go_on(checkpoint.methods);
    const bool is_repeatable = is_repeatable_ && controls_.methods.size() == 1;
    make_method_at_work();
    is_repeatable_ = is_repeatable;
    steps_ = checkpoint.steps;
    system_.slope(t_, z_.data(), method_->first_slope());
    delivery_.go_on(checkpoint.outputs);
  }

  IntegrationReport run() {
    if (controls_.repeated_steps.empty())
      choose_steps();
    else
      repeat_steps();
    report_.time = t_;
    report_.outputs = delivery_.outputs();
    report_.evaluations = system_.evaluations();
    if (!is_repeatable_)
      report_.step_ends.clear();
    return report_;
  }

  VectorXd final_state() const { return Map<const VectorXd>(state(z_.data()), system_.local().state_size()); }

  IntegrationCheckpoint checkpoint() const {
    return {t_, final_state(), steps_, delivery_.outputs(), methods_.history()};
  }

private:
  const double *state(const double *z) const { return system_.local().state(z); }

  void choose_steps() {
    while (!delivery_.is_complete() && may_go_on()) {
      if (jump_ && jump_->before <= at_once()) {
        pass_jump();
        if (delivery_.is_complete())
          break;
      }
      steps_.next_step = std::min(steps_.next_step, duration_);
      const Attempt attempt = next_attempt();
      const Allowance allowance =
          allowance_of(attempt.step, method_->error_share(attempt.step / duration_), steps_, controls_.tolerance);
      const double size = try_step(attempt, allowance);
      report_.last_step = attempt.step;
      report_.last_error = size;
      if (size <= 1) {
        accept(attempt, allowance, size);
      } else {
        ++report_.rejected;
        steps_.next_step = control_.after_rejected(attempt.step, size);
        look_for_jump(attempt);
      }
      if (!delivery_.is_complete() && methods_.takes_over(t_, method_->damps()))
        change_method();
    }
  }

  void repeat_steps() {
    if (breaks_)
      throw std::invalid_argument("repeated steps: expected no breaks, found some");
    const std::vector<double> &ends = controls_.repeated_steps;
    for (auto end = std::upper_bound(ends.begin(), ends.end(), t_); end != ends.end(); ++end) {
      const Attempt attempt{*end, *end - t_, *end, false};
      steps_.next_step = report_.last_step = attempt.step;
      if (!may_go_on())
        return;
      if (!method_->step(t_, z_.data(), attempt.step, controls_.tolerance) || !method_->finish(attempt.end)) {
        report_.last_error = NAN;
        report_.status = IntegrationStatus::step_underflow;
        return;
      }
      if (!delivery_.is_complete() && delivery_.next_time() < attempt.end)
        method_->prepare_dense(t_, z_.data(), attempt.step);
      take(attempt);
    }
  }

  void make_method_at_work() {
    is_repeatable_ = false;
    method_ = make_method(methods_.at_work(), system_);
    control_ = StepControl(method_->error_order());
  }

  // The method at work knows nothing of what was before.
  void begin_method() {
    StepHistory steps;
    steps.in_transient = method_->damps();
    steps.next_step = method_->damps() ? end_ - t_ : std::min(system_.initial_step(), end_ - t_);
    steps.reserve = steps_.reserve;
    steps_ = steps;
    system_.slope(t_, z_.data(), method_->first_slope());
  }

  void change_method() {
    make_method_at_work();
    begin_method();
    delivery_.record_method(methods_.at_work());
    report_.changes.push_back({t_, methods_.before().kind, methods_.at_work().kind, methods_.mean_step()});
  }

  // False where the run ends here, with its status set.
  bool may_go_on() {
    if (report_.status == IntegrationStatus::completed)
      report_.status = watch_.look(t_, steps_.next_step, report_.steps + report_.rejected);
    return report_.status == IntegrationStatus::completed;
  }

  Attempt next_attempt() {
    bool lands = method_->lands_on_outputs();
    double target = lands ? delivery_.next_time() : end_;
    const auto end_at = [&](double t) {
      lands = lands || t <= target;
      target = std::min(t, target);
    };
    if (breaks_ && next_break_ < breaks_->times.size())
      end_at(breaks_->times[next_break_]);
    if (jump_)
      end_at(jump_->before);
    while (next_stop_ < controls_.stops.size() && controls_.stops[next_stop_] <= at_once())
      ++next_stop_;
    if (next_stop_ < controls_.stops.size())
      end_at(controls_.stops[next_stop_]);
    const double wanted = next_step(steps_.next_step, target - t_, lands);
    const double fastest = system_.local().fastest_rotation(z_.data() + system_.n_v());
    const double step = std::min(step_limit_.of(t_, wanted), most_turn / fastest);
    const bool is_limited = step < wanted;
    if (step == target - t_)
      return {target, step, target, is_limited};
    const double end = lands || is_limited ? t_ + step : std::min(system_.end_of_step(t_, step), target);
    return {target, end == t_ + step ? step : end - t_, end, is_limited};
  }

  // Size of the step's error relative to the largest one allowed; NaN where it could not be made.
  double try_step(const Attempt &attempt, const Allowance &allowance) {
    if (!method_->step(t_, z_.data(), attempt.step, allowance.to_iterate) ||
        !system_.local().is_within_half_turns(method_->end()) || !method_->finish(attempt.end))
      return NAN;
    method_->estimate(attempt.step, error_);
    double size = system_.error_size(attempt.end, method_->end(), error_.data()) / allowance.error;
    by_rounding_ = 0;
    if (size > StepControl::target && (method_->damps() || attempt.step < radian * system_.initial_step()))
      size = beyond_rounding(attempt, allowance, size);
    const bool is_dense = size <= 1 && delivery_.next_time() < attempt.end;
    return is_dense ? std::max(dense_size(attempt), size) : size; // keeps NaN
  }

  // What of that size is more than rounding
  double beyond_rounding(const Attempt &attempt, const Allowance &allowance, double size) {
    const VectorXd &left =
        rounding_.error(t_, z_.data(), method_->first_slope(), attempt.step, *method_, error_, steps_.without_look);
    if (left.isZero(0))
      return size;
    system_.slope(attempt.end, method_->end(), method_->last_slope());
    const double by_rounding = system_.error_size(attempt.end, method_->end(), left.data());
    if (!(by_rounding <= hopeless))
      return size;
    const auto without = [&](double draws) {
      by_rounding_ = draws * by_rounding;
      return std::max(size - by_rounding_ / allowance.error, 0.0);
    };
    const double beyond_one = without(1);
    return beyond_one <= 1 ? beyond_one : std::max(without(scatter), StepControl::target); // the step does not grow
  }

  // That of outputs between its ends, which no later step depends on: relative to the whole tolerance.
  double dense_size(const Attempt &attempt) {
    method_->prepare_dense(t_, z_.data(), attempt.step);
    if (!method_->estimate_dense(error_) ||
        system_.change_size(method_->end(), error_.data(), radians_too_long / attempt.step) <=
            notable * controls_.tolerance)
      return 0;
    system_.slope(attempt.end, method_->end(), method_->last_slope());
    return system_.error_size(attempt.end, method_->end(), error_.data()) / controls_.tolerance;
  }

  void accept(const Attempt &attempt, const Allowance &allowance, double size) {
    report_.rounding += by_rounding_;
    size = take_from_reserve(attempt.step, allowance, size, steps_);
    if (!take(attempt))
      return;
    // A step that was shortened to land on an output tells what the step asked for would have cost. One that was
    // shortened much, to end at a break or a jump or by what is prescribed, tells nothing: the next step stays as long
    // as the control had asked for.
    const double asked = std::clamp(steps_.next_step, attempt.step, 2 * attempt.step);
    const bool ends_early =
        attempt.is_limited || (t_ == attempt.target && (breaks_ || jump_ || !controls_.stops.empty()));
    if (!(ends_early && 2 * attempt.step < steps_.next_step))
      steps_.next_step = control_.after_accepted(
          asked, asked > attempt.step ? size * std::pow(asked / attempt.step, method_->error_order()) : size, steps_);
    if (pass_breaks()) {
      system_.slope(t_, z_.data(), method_->first_slope());
      method_->restart();
    }
  }

  // False where the run ends with the step just made.
  bool take(const Attempt &attempt) {
    ++report_.steps;
    delivery_.outputs_of_step(*method_, attempt.end);
    delivery_.sample_step(*method_, t_, z_.data(), attempt.step, attempt.end);
    if (limit_watch_)
      limit_watch_->look(*method_, methods_.at_work(), t_, z_.data(), attempt.step);
    move_to_end(attempt);
    delivery_.outputs_at(at_once(), z_.data()); // also those that round-off puts behind it
    if (controls_.keep_steps)
      report_.step_ends.push_back(t_);
    if (!system_.is_sensible(z_.data()))
      report_.status = IntegrationStatus::diverged;
    return report_.status == IntegrationStatus::completed;
  }

  void move_to_end(const Attempt &attempt) {
    t_ = attempt.end;
    method_->accept(attempt.step);
    z_ = Map<const VectorXd>(method_->end(), system_.size());
    std::copy_n(method_->last_slope(), system_.size(), method_->first_slope());
    if (system_.local().recentre(z_.data(), method_->first_slope()))
      method_->recentred();
    system_.accepted(t_, z_.data(), method_->first_slope());
    delivery_.record(t_, z_.data());
  }

  void look_for_jump(const Attempt &attempt) {
    const double usual = steps_.usual_step > 0 ? steps_.usual_step : system_.initial_step();
    if (attempt.step > may_have_met_jump * usual || attempt.end <= searched_until_)
      return;
    jump_ = find_jump(system_, z_.data(), t_, attempt.end);
    if (jump_)
      steps_.next_step = usual;
    else
      searched_until_ = attempt.end;
  }

  // The latest time that cannot be told from now.
  double at_once() const { return t_ + no_time * std::max(std::abs(t_), duration_); }

  // The state is the same on both sides.
  void pass_jump() {
    is_repeatable_ = false;
    t_ = jump_->after;
    jump_.reset();
    delivery_.record(t_, z_.data());
    delivery_.sample(t_, z_.data());
    delivery_.outputs_at(at_once(), z_.data());
    pass_breaks();
    system_.slope(t_, z_.data(), method_->first_slope());
    method_->restart();
  }

  // True where loads have jumped at t.
  bool pass_breaks() {
    const std::size_t before = next_break_;
    while (breaks_ && next_break_ < breaks_->times.size() && breaks_->times[next_break_] <= at_once()) {
      breaks_->at(next_break_, t_, state(z_.data()));
      ++next_break_;
    }
    return next_break_ > before;
  }

  OdeSystem &system_;
  const IntegrationControls &controls_;
  const Breaks *breaks_;
  LimitWatch *limit_watch_;
  Delivery delivery_;
  Watch watch_;
  StepLimit step_limit_;
  FasterMethod methods_;
  std::unique_ptr<Method> method_;
  StepControl control_;
  StepHistory steps_;
  IntegrationReport report_;
  double t_, end_, duration_;
  std::size_t next_break_ = 0, next_stop_ = 0;
  bool is_repeatable_;         // by the ends of steps alone
  std::optional<Jump> jump_;   // the next one that is known
  double searched_until_ = t_; // there is no other before
  Rounding rounding_;
  double by_rounding_ = 0; // part of the error of the step just tried
  VectorXd z_, error_;     // local coordinates (ode.h)
};

} // namespace

const MethodChoice &Recording::method_of(std::size_t step) const {
  const auto after = std::find_if(methods.begin(), methods.end(), [&](const auto &m) { return m.first > step; });
  return std::prev(after)->second;
}

IntegrationReport integrate(OdeSystem &system, const std::vector<double> &times, VectorXd &y,
                            const IntegrationControls &controls, const StateFunctionOfTime &output,
                            const std::function<bool(double)> &carry_on, const Companions &with) {
  Integration integration(system, times, y, controls, output, carry_on, with);
  IntegrationCheckpoint *checkpoint = with.checkpoint;
  if (checkpoint && checkpoint->has_begun())
    integration.go_on(*checkpoint);
  else
    integration.begin();
  if (with.recording)
    with.recording->tolerance = controls.tolerance;
  const IntegrationReport report = integration.run();
  y = integration.final_state();
  if (checkpoint)
    *checkpoint = integration.checkpoint();
  return report;
}

} // namespace ffrobot
