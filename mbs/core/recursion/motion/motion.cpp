#include "core/recursion/motion/motion.h"

#include "core/recursion/motion/independent_constraints.h"

namespace ffrobot::recursion {

namespace {

constexpr double singular_ratio = 4e-6; // of postures: below, joints cannot follow, and rounding leaves 1e-5 of forces
constexpr double near = 0.01;           // likewise: above, …
constexpr double brief = 1. / 4000;     // … postures hardly change within this part of a run
constexpr int instants = 100;           // of a run, at which accelerations on paths are looked at
constexpr double least_shift = 1e-8;    // of a state, relative: forces change by more than their rounding
constexpr double is_on = 1e-11;         // residuals of a state on its constraint equations
constexpr double rounding = 8 * std::numeric_limits<double>::epsilon(); // of mobilities, relative, as sums
constexpr double hopeless = 0.1; // of forces: more rounding is none that a run could go on with

// What rounding leaves of multipliers, relative: each follows from what other equations leave of its own mobility,
// which is next to nothing where they hardly differ.
template <class Space> double rounding_of_multipliers(const Workspace<Space, double> &w) {
  const int m = w.factored();
  double found = 0;
  for (int r = 0; r < m; ++r) {
    const double *L = w.factor.data() + r * m;
    double own = 1 / L[r];
    for (int c = 0; c < r; ++c)
      own += L[c] * L[c] / w.factor[c * m + c];
    found = std::max(found, rounding * own * L[r]);
  }
  return found < hopeless ? found : 0;
}

} // namespace

template <class Space>
RecursiveMotion<Space>::RecursiveMotion(const Mechanism<Space> &mechanism, const Scene &scene, double t,
                                        const double *q, const double *v, const ZeroOrderHold *held,
                                        ExternalForces *external)
    : NewtonSystem<Space>(mechanism, scene), workspace_(mechanism), measured_(mechanism),
      forces_(mechanism, scene, held, external), laws_(scene, mechanism.constraints.size()), norm_(mechanism),
      value_(VectorXd::Zero(mechanism.constraints.size())), rate_(value_), correction_(VectorXd::Zero(mechanism.n_v)),
      state_(VectorXd::Zero(mechanism.n_q + mechanism.n_v)), shifted_(VectorXd::Zero(2 * mechanism.n_v)),
      unused_(correction_) {
  go_to(t);
  if (scene.has_loops)
    keep_independent_constraints(q, v, workspace_);
  if (!mechanism.constraints.empty())
    evaluate(t, q, v, correction_.data()); // projections need its factors
  at_rest_.keep(workspace_.active);
  for (const int r : workspace_.active)
    if (const Constraint &of = mechanism.constraints[r]; forces_.acts() && of.model.kind == ConstraintKind::coordinate)
      borne_.push_back({mechanism.nodes[of.node].v + of.freedom, r, 0});
  if (scene.has_loops && !workspace_.active.empty())
    loops_.emplace(workspace_);
  for (const GearSpring &gear : scene_.gears)
    for (const Node<Space> &node : mechanism.nodes)
      if (node.v == gear.a.v)
        norm_.add_spring(*std::max_element(gear.spring.slopes.begin(), gear.spring.slopes.end()),
                         node.rotor_inertia * node.gear_ratio * node.gear_ratio);
  for (const Node<Space> &node : mechanism.nodes)
    for (int k = 0; k < node.n(); ++k)
      fastest_ = std::max(fastest_, std::sqrt(node.body.K[k])), steps_between_postures_ = 10;
}

template <class Space> void RecursiveMotion<Space>::plan(double begin, double end) {
  double acceleration = 0;
  for (int i = 0; i <= instants && !scene_.targets.empty(); ++i) {
    const auto targets = targets_at(scene_, begin + (end - begin) * i / instants);
    for (std::size_t r = 0; r < targets.size(); ++r)
      if (const double a = std::abs(targets[r].acceleration); std::isfinite(a))
        acceleration =
            std::max(acceleration, is_moment(mechanism_, mechanism_.constraints[r]) ? norm_.sizes().length() * a : a);
  }
  norm_.plan(end - begin, acceleration);
  between_postures_ = brief * (end - begin);
}

template <class Space> void RecursiveMotion<Space>::turn_markers(double t) {
  for (const DrivenMarker &driven : scene_.driven) {
    const std::size_t i = driven.marker;
    workspace_.turning[i] = measured_.turning[i] = at_rest_.turning[i] = driven.law(t);
  }
}

template <class Space> void RecursiveMotion<Space>::set_stage_times(const double *times, int count) {
  laws_.set_stage_times(times, count);
  forces_.set_stage_times(times, count);
}

template <class Space>
[[gnu::always_inline]] inline void RecursiveMotion<Space>::evaluate_here(double t, const double *q, const double *v,
                                                                         double *a) {
  go_to(t);
  auto placed = std::exchange(placed_, std::nullopt);
  Forces<double> forces;
  if (forces_.acts()) {
    const auto acting = forces_.at(t, q, v, workspace_);
    forces = acting.forces;
    if (acting.placed)
      placed.emplace(*acting.placed);
    for (Borne &of : borne_)
      of.force = forces_.take(of.v);
  }
  if (placed)
    accelerations(*placed, forces.wrench, laws_.accelerations(), a);
  else
    accelerations(q, v, forces, laws_.accelerations(), workspace_, a);
  for (const Borne &of : borne_)
    workspace_.lambda[of.row] += of.force;
}

template <class Space> void RecursiveMotion<Space>::evaluate(double t, const double *q, const double *v, double *a) {
  evaluate_here(t, q, v, a);
}

template <class Space> void RecursiveMotion<Space>::renew(double t, const double *q, const double *v, double *a) {
  const std::vector<int> &before = at_rest_.active;
  if (!loops_ || before.size() == mechanism_.constraints.size() || !loops_->is_poor(workspace_))
    return;
  keep_independent_constraints(q, v, workspace_, before.size());
  const bool are_others = workspace_.active != before && workspace_.active.size() == before.size();
  if (!are_others) // or next to a singular posture
    workspace_.keep(before);
  at_rest_.keep(workspace_.active);
  evaluate(t, q, v, a ? a : unused_.data());
  if (are_others)
    loops_.emplace(workspace_);
  loops_->begin_at(q, workspace_, at_rest_);
}

template <class Space> void RecursiveMotion<Space>::slope(double t, const double *z, double *z_dot) {
  const double *q = local().state(z), *v = z + n_v();
  local().rate(z, z_dot);
  evaluate_here(t, q, v, z_dot + n_v());
  if (loops_ && !loops_->has_begun())
    loops_->begin_at(q, workspace_, at_rest_);
}

template <class Space> void RecursiveMotion<Space>::round_off(const double *z, double relative, double *z_dot) {
  std::fill_n(z_dot, n_v(), 0.0);
  for (const Borne &of : borne_)
    workspace_.lambda[of.row] -= of.force;
  recursion::round_off(local().state(z), relative, workspace_, z_dot + n_v());
}

template <class Space>
Placed<Space, double> RecursiveMotion<Space>::residuals(double t, const double *q, const double *v,
                                                        Workspace<Space, double> &w) {
  go_to(t);
  const auto at = measure(q, v, w, value_.data(), rate_.data());
  for (Index r = 0; r < value_.size(); ++r) {
    const Jet law = laws_.of(r);
    value_[r] = mechanism_.constraints[r].apart(value_[r], law.value);
    rate_[r] = workspace_.column[r] ? rate_[r] - law.rate : 0; // what is left out follows from positions
  }
  return at;
}

template <class Space> double RecursiveMotion<Space>::project(double t, double *q, double *v, bool is_next) {
  // Rounding of positions, moved into fast modes, is noise in their forces.
  constexpr double tolerance = 1e-12;
  constexpr int refresh_after = 3, most_iterations = 12;
  if (mechanism_.constraints.empty())
    return 0;
  Map<VectorXd> v_(v, n_v());
  double left = 0, previous = std::numeric_limits<double>::infinity();
  for (int i = 0; i < most_iterations; ++i) {
    const auto at = residuals(t, q, v, is_next ? workspace_ : measured_);
    const double position = norm_.sizes().of_values(value_, q);
    left = std::max(position, norm_.sizes().of_rates(rate_, v));
    if (!(left > tolerance) || (left < is_on && left > 0.2 * previous)) { // done, at the rounding floor, or NaN
      if (is_next)
        placed_.emplace(at);
      break;
    }
    previous = left;
    if (i >= refresh_after)
      evaluate(t, q, v, correction_.data());
    response(q, rate_.data(), workspace_, correction_.data());
    v_ += correction_;
    if (position > tolerance) {
      response(q, value_.data(), workspace_, correction_.data());
      local().space().integrate(q, 1, correction_.data(), q);
    }
  }
  return left;
}

template <class Space> bool RecursiveMotion<Space>::correct(double t, double *z) {
  if (local().space().is_flat())
    return project(t, z, z + n_v()) < is_on;
  state_ = Map<const VectorXd>(local().state(z), local().state_size());
  const double left = project(t, state_.data(), state_.data() + mechanism_.n_q);
  local().from_state(state_.data(), z);
  return left < is_on;
}

// Residuals are measured with the kinematics that the slope needs, too.
template <class Space> bool RecursiveMotion<Space>::finish(double t, double *z, double *z_dot) {
  if (forces_.acts() || !local().space().is_flat())
    return correct(t, z) && (slope(t, z, z_dot), true);
  const bool is_on_constraints = project(t, z, z + n_v(), true) < is_on;
  if (is_on_constraints)
    slope(t, z, z_dot);
  placed_.reset();
  return is_on_constraints;
}

template <class Space> void RecursiveMotion<Space>::judge(MotorForces<Space> &motors) {
  motors_ = &motors;
  norm_.add_motors(motors.are_moments());
}

template <class Space> const VectorXd *RecursiveMotion<Space>::motors_at(const double *q) {
  return motors_ && norm_.judges_motors() ? &motors_->find(q, workspace_) : nullptr;
}

template <class Space> double RecursiveMotion<Space>::error_size(double t, const double *z, const double *e) {
  const double size = norm_.of_state(e);
  norm_.observe(workspace_, motors_at(local().state(z)));
  if (!norm_.observes())
    return size;
  if (loops_ && !(loops_->cosine(local().state(z), workspace_) > 0)) // shorter steps end before that posture
    return std::numeric_limits<double>::infinity();
  // Forces amplify errors of the state (stiffness times the error of a fast mode): measure what e does to them. Where
  // it is small, in a difference that rounding of forces does not disturb.
  const double stretch = size > 0 ? std::max(1.0, least_shift / size) : 1;
  shifted_ = Map<const VectorXd>(z, 2 * n_v()) + stretch * Map<const VectorXd>(e, 2 * n_v());
  const double *q = local().state(shifted_.data());
  evaluate(t, q, shifted_.data() + n_v(), unused_.data());
  const double change = norm_.of_observed(workspace_, motors_at(q)) - rounding_of_multipliers(workspace_);
  const double of_forces = change / stretch;
  return of_forces <= size || std::isnan(size) ? size : of_forces; // keeps NaN
}

template <class Space>
double RecursiveMotion<Space>::change_size(const double *, const double *change, double rate) const {
  return norm_.of_change(change, rate);
}

template <class Space> void RecursiveMotion<Space>::accepted(double t, const double *z, const double *z_dot) {
  if (accepted_ == 0)
    norm_.observe(workspace_, motors_at(local().state(z)));
  renew(t, local().state(z), z + n_v());
  if (loops_ && loops_->is_far())
    loops_->begin_at(local().state(z), workspace_, at_rest_);
  norm_.take(z, z_dot, forces_.generalized(), workspace_);
  const bool is_new = postures_.least_ratio < near || t >= postures_.watched_at + between_postures_;
  if (accepted_ == 0 || (accepted_ % steps_between_postures_ == 0 && is_new))
    watch_posture(t, local().state(z));
  ++accepted_;
}

template <class Space> void RecursiveMotion<Space>::watch_posture(double t, const double *q) {
  if (!scene_.watch)
    return;
  go_to(t);
  look(*scene_.watch, t, q, measured_, postures_);
}

template <class Space> Index RecursiveMotion<Space>::prescribed() const {
  const std::size_t count =
      scene_.targets.size() + scene_.loads.size() + scene_.point_loads.size() + scene_.cut_loads.size();
  return count;
}

template <class Space> void RecursiveMotion<Space>::prescribe(double t, double *f) {
  go_to(t);
  f = std::copy_n(laws_.accelerations(), scene_.targets.size(), f);
  for (const Load &load : scene_.loads)
    *f++ = load.magnitude(t).value;
  for (const PointLoad &load : scene_.point_loads)
    *f++ = load.magnitude(t).value;
  for (const CutLoad &load : scene_.cut_loads)
    *f++ = load.magnitude(t).value;
}

template <class Space> bool RecursiveMotion<Space>::is_sensible(const double *z) const {
  for (std::size_t i = 0; i < scene_.modal_amplitude_limits.size(); ++i) {
    const Node<Space> &node = mechanism_.nodes[i];
    if (!(Map<const VectorXd>(z + node.p_v(), node.n()).squaredNorm() <= scene_.modal_amplitude_limits[i]))
      return false;
  }
  return postures_.least_ratio >= singular_ratio && (0 * Map<const ArrayXd>(z, 2 * n_v())).sum() == 0; // all finite
}

template <class Space> void RecursiveMotion<Space>::go_on(const MotionHistory &history) {
  norm_.set_peaks(history.peaks);
  accepted_ = history.accepted;
  workspace_.keep(history.kept), at_rest_.keep(history.kept);
  postures_ = history.postures;
}

template <class Space> void RecursiveMotion<Space>::linearise(double t, const double *z) {
  go_to(t);
  this->linearise_at(local().state(z), z + n_v());
}

template <class Space>
void RecursiveMotion<Space>::constraint_values(double t, const double *z, double *value, double *rate) {
  residuals(t, local().state(z), z + n_v(), measured_);
  Map<VectorXd>(value, value_.size()) = value_;
  Map<VectorXd>(rate, rate_.size()) = rate_;
}

template <class Space> double RecursiveMotion<Space>::value_size(const double *z, const VectorXd &value) const {
  return norm_.sizes().of_values(value, local().state(z));
}

template <class Space> double RecursiveMotion<Space>::rate_size(const double *z, const VectorXd &rate) const {
  return norm_.sizes().of_rates(rate, z + n_v());
}

template class RecursiveMotion<Planar>;
template class RecursiveMotion<Spatial>;

} // namespace ffrobot::recursion
