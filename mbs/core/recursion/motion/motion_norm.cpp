#include "core/recursion/motion/motion_norm.h"

#include "core/recursion/numbers/four_doubles.h"

#include <limits>
#include <map>

namespace ffrobot::recursion {

namespace {

constexpr double small_force = 2e-4; // of the largest: forces below count like this one
constexpr double leverage = 2;       // of multipliers: motors' moments follow from them, and may be small beside them;
                                     // and where nothing else tells of the forces of fast modes
constexpr double small_motor = 0.1;  // of the largest: what motors do is judged below
constexpr double small_arm = 1e-2;   // of a body's length: moments count like the largest force at it
constexpr double slow = 0.01;        // of the natural pace: rates of joints below, times the peak of what they are of
constexpr double early = 0.1;        // of the largest acceleration on a path: smaller ones count like this part
constexpr double small_bend = 1e-3;  // of what a body's acceleration would do to its softest mode
constexpr double nothing = std::numeric_limits<double>::min(); // of groups without members

double square(double x) { return x * x; }

void grow(double &peak, double squared) {
  if (squared > peak * peak)
    peak = std::sqrt(squared);
}

double size_of_turn(double omega) { return std::abs(omega); }
double size_of_turn(const double (&omega)[3]) { return std::hypot(omega[0], omega[1], omega[2]); }

// Of accelerations, of these times the radians of modes, and times their squares
struct SquaresOfModes {
  double plain = 0, rate = 0, way = 0;

  SquaresOfModes(const double *a, const double *radian, Index count) {
    FourSums of_plain, of_rate, of_way;
    for_fours(count, [&](Index first, auto read) __attribute__((always_inline)) {
      const auto x = read(a + first), s = read(radian + first), rate = x * s, way = rate * s;
      of_plain.add(x * x), of_rate.add(rate * rate), of_way.add(way * way);
    });
    plain = of_plain(), rate = of_rate(), way = of_way();
  }
};

// The larger one; NaN where one is, as past the end of a load that has no value from there on
double larger(double x, double y) { return x >= y || std::isnan(x) ? x : y; }

} // namespace

template <class Space>
MotionNorm<Space>::MotionNorm(const Mechanism<Space> &mechanism)
    : mechanism_(mechanism), sizes_(mechanism), pace_{0, 0} {
  group_states();
  group_forces();
  find_pace();
  add_motors({});
}

template <class Space> void MotionNorm<Space>::group_states() {
  const std::size_t n = mechanism_.n_v;
  group_.assign(2 * n, 0), radian_.assign(n, 0);
  for (const Node<Space> &node : mechanism_.nodes) {
    for (int k = 0; k < node.shape.freedoms.count; ++k)
      group_[node.v + k] = node.shape.freedoms.component[k] < Space::linear ? 0 : 1;
    double lowest = std::numeric_limits<double>::infinity();
    for (int k = 0; k < node.n(); ++k) {
      const std::size_t i = node.p_v() + k;
      group_[i] = static_cast<int>(pace_.size());
      const double frequency = std::sqrt(node.body.K[k]);
      radian_[i] = frequency > 0 ? 1 / frequency : 0;
      lowest = std::min(lowest, frequency);
    }
    if (node.n() > 0)
      pace_.push_back(lowest);
  }
  for (std::size_t i = 0; i < n; ++i)
    group_[n + i] = group_[i] + static_cast<int>(pace_.size());
  size_ = by_forces_ = by_given_ = std::vector<double>(2 * pace_.size(), 0.0);
  of_rates_.assign(pace_.size(), 0.0), peak_.assign(3 * pace_.size(), 0.0);
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t group = group_[i];
    if (runs_.empty() || runs_.back().group != group)
      runs_.push_back({static_cast<Index>(i), 0, group});
    ++runs_.back().count;
  }
}

template <class Space> void MotionNorm<Space>::group_forces() {
  std::map<std::pair<std::string, bool>, int> known;
  for (const Constraint &row : mechanism_.constraints) {
    const auto key = std::pair(row.model.name, is_moment(mechanism_, row));
    const auto [at, is_new] = known.emplace(key, static_cast<int>(known.size()));
    if (is_new)
      is_moment_.push_back(key.second);
    force_group_.push_back(at->second);
  }
  leverage_.assign(is_moment_.size(), leverage);
  const auto add_joint = [&](std::vector<std::size_t> &to, std::size_t at) {
    const int force = is_moment_.size();
    to.push_back(at);
    is_moment_.insert(is_moment_.end(), {false, true}), leverage_.insert(leverage_.end(), 2, leverage);
    for (int i = 0; i < Space::dim; ++i)
      force_group_.push_back(i < Space::linear ? force : force + 1);
  };
  for (std::size_t port = 0; port < mechanism_.children.size(); ++port)
    if (mechanism_.children[port] >= 0)
      add_joint(carriers_, port); // forces between bodies stand for those on the ground, too
  for (std::size_t i = 0; i < mechanism_.nodes.size(); ++i)
    if (mechanism_.nodes[i].is_single_grounded)
      add_joint(alone_, i);
}

template <class Space> void MotionNorm<Space>::add_motors(const std::vector<bool> &are_moments) {
  for (const bool is_moment : are_moments) {
    force_group_.push_back(static_cast<int>(is_moment_.size()));
    is_moment_.push_back(is_moment), leverage_.push_back(1);
  }
  motors_ += are_moments.size();
  force_now_ = force_error_ = force_peak_ = std::vector<double>(is_moment_.size(), 0.0);
  observed_ = change_ = VectorXd::Zero(force_group_.size());
}

template <class Space> void MotionNorm<Space>::plan(double duration, double acceleration) {
  sizes_.plan(duration);
  of_paths_ = acceleration;
  find_pace();
}

template <class Space> void MotionNorm<Space>::find_pace() {
  pace_[0] = slow * sizes_.pace(), pace_[1] = std::max(pace_[0], pace_of_springs_);
  slow_acceleration_ = std::max(slow * sizes_.acceleration(), early * of_paths_);
}

template <class Space> void MotionNorm<Space>::add_spring(double stiffness, double inertia) {
  of_springs_ = std::max(of_springs_, small_twist * stiffness);
  pace_of_springs_ = std::max(pace_of_springs_, small_twist * std::sqrt(stiffness / inertia));
  find_pace();
}

// size_: of all groups
template <class Space> void MotionNorm<Space>::add_squares(const double *z) const {
  double *of_z = size_.data(), *of_rates = of_z + pace_.size();
  for (double &size : size_)
    size = 0;
  const double *z_dot = z + radian_.size();
  for (const auto &[first, count, group] : runs_) {
    FourSums sum, sum_of_rates;
    for_fours(count, [&](Index i, auto read) __attribute__((always_inline)) {
      const auto x = read(z + first + i), x_dot = read(z_dot + first + i);
      sum.add(x * x), sum_of_rates.add(x_dot * x_dot);
    });
    of_z[group] += sum(), of_rates[group] += sum_of_rates();
  }
}

template <class Space> double MotionNorm<Space>::of_state(const double *e) const {
  add_squares(e);
  double worst = 0;
  for (std::size_t g = 0; g < size_.size(); ++g)
    worst = larger(worst, size_[g] / std::max(square(peak_[g]), nothing));
  return std::sqrt(worst);
}

template <class Space> double MotionNorm<Space>::of_change(const double *change, double rate) const {
  const std::size_t groups = pace_.size();
  double worst = of_state(change);
  for (std::size_t g = 0; g < groups; ++g)
    worst = larger(worst, rate * std::sqrt(size_[groups + g]) / std::max(peak_[2 * groups + g], nothing));
  return worst;
}

template <class Space>
void MotionNorm<Space>::forces(const Workspace<Space, double> &w, const VectorXd *motors, VectorXd &values) const {
  double *to = std::copy_n(w.lambda.data(), mechanism_.constraints.size(), values.data());
  const auto add = [&](const double *f) {
    for (int i = 0; i < Space::dim; ++i)
      *to++ = f[i];
  };
  for (const std::size_t port : carriers_)
    add(w.ports[port].f);
  for (const std::size_t node : alone_)
    add(w.hinges[node].f);
  for (std::size_t i = 0; i < motors_; ++i)
    *to++ = motors ? (*motors)[i] : 0;
}

template <class Space>
void MotionNorm<Space>::sizes_of_forces(const VectorXd &values, std::vector<double> &size) const {
  std::fill(size.begin(), size.end(), 0.0);
  for (std::size_t r = 0; r < force_group_.size(); ++r)
    size[force_group_[r]] += square(values[r]);
  for (double &x : size)
    x = std::sqrt(x);
}

template <class Space> void MotionNorm<Space>::observe(const Workspace<Space, double> &w, const VectorXd *motors) {
  forces(w, motors, observed_);
}

template <class Space> typename MotionNorm<Space>::Largest MotionNorm<Space>::largest() const {
  double force = inertial_, moment = 0;
  for (std::size_t g = 0; g < is_moment_.size(); ++g)
    (is_moment_[g] ? moment : force) = std::max(is_moment_[g] ? moment : force, force_peak_[g]);
  force = std::max(force, moment / sizes_.length());
  return {force, std::max(moment, small_arm * sizes_.length() * force)};
}

template <class Space> bool MotionNorm<Space>::judges_motors() const {
  if (motors_ == 0)
    return false;
  const auto [force, moment] = largest();
  for (std::size_t g = is_moment_.size() - motors_; g < is_moment_.size(); ++g)
    if (force_peak_[g] <= small_motor * (is_moment_[g] ? moment : force))
      return true;
  return false;
}

template <class Space>
double MotionNorm<Space>::of_observed(const Workspace<Space, double> &w, const VectorXd *motors) {
  forces(w, motors, change_), change_ -= observed_;
  sizes_of_forces(observed_, force_now_), sizes_of_forces(change_, force_error_);
  const auto [force, moment] = largest();
  double worst = 0;
  for (std::size_t g = 0; g < is_moment_.size(); ++g) {
    const double least = small_force * (is_moment_[g] ? moment : force);
    const double of_springs = is_moment_[g] ? of_springs_ : of_springs_ / sizes_.length();
    const double scale = std::max({force_peak_[g], force_now_[g], least, of_springs, nothing});
    worst = larger(worst, leverage_[g] * force_error_[g] / scale);
  }
  return worst;
}

template <class Space>
void MotionNorm<Space>::take(const double *z, const double *z_dot, const double *applied,
                             const Workspace<Space, double> &w) {
  const std::size_t n = radian_.size();
  const std::size_t groups = pace_.size();
  // what the forces on modes will do to them, and what given ones would do alone, which may hold a link straight
  for (std::vector<double> *sizes : {&by_forces_, &by_given_, &of_rates_})
    std::fill(sizes->begin(), sizes->end(), 0.0);
  add_squares(z);
  for (const auto &[first, count, group] : runs_) {
    const double *a = z_dot + n + first, *radian = radian_.data() + first;
    if (group < 2) { // joints
      of_rates_[group] += sum_of_squares(a, count);
      continue;
    }
    const SquaresOfModes by_forces(a, radian, count);
    of_rates_[group] += by_forces.plain;
    by_forces_[groups + group] += by_forces.rate, by_forces_[group] += by_forces.way;
    if (applied) {
      const SquaresOfModes by_given(applied + first, radian, count);
      by_given_[groups + group] += by_given.rate, by_given_[group] += by_given.way;
    }
  }
  for (std::size_t g = 0; g < size_.size(); ++g)
    grow(peak_[g], std::max({size_[g], by_forces_[g], by_given_[g]}));
  for (std::size_t g = 0; g < groups; ++g)
    grow(peak_[size_.size() + g], of_rates_[g]);
  take_accelerations(w);
  // Rotation vectors start at zero in every step: an angle is compared with one radian at least, a way with a length.
  peak_[0] = std::max(peak_[0], sizes_.length()), peak_[1] = std::max(peak_[1], 1.0);
  // At rest, as in equilibrium, all rates are zero: their errors are then compared with rates that would be slow.
  for (std::size_t g = 0; g < pace_.size(); ++g)
    peak_[pace_.size() + g] = std::max(peak_[pace_.size() + g], pace_[g] * peak_[g]);
  sizes_of_forces(observed_, force_now_);
  for (std::size_t g = 0; g < force_peak_.size(); ++g)
    force_peak_[g] = std::max(force_peak_[g], force_now_[g]);
}

template <class Space> void MotionNorm<Space>::take_accelerations(const Workspace<Space, double> &w) {
  double inertial = 0, &of_ways = peak_[size_.size()], &of_angles = peak_[size_.size() + 1];
  const double least = std::max(mechanism_.gravity.norm(), slow_acceleration_);
  of_ways = std::max(of_ways, least);
  for (std::size_t i = 0; i < mechanism_.nodes.size(); ++i) {
    const Node<Space> &node = mechanism_.nodes[i];
    const auto &A = w.bodies[i].A;
    double sum = 0;
    for (int k = 0; k < Space::linear; ++k)
      sum += square(A[k]);
    const double acceleration = std::sqrt(sum), mass = node.body.mass;
    inertial += mass * std::max(acceleration, slow_acceleration_);
    of_ways = std::max(of_ways, acceleration);
    if (node.n() > 0) {
      // where nothing has happened yet, or what acts holds the link straight
      const std::size_t g = group_[node.p_v()];
      const double force = std::sqrt(mass) * std::max(acceleration, least);
      peak_[g] = std::max(peak_[g], small_bend * force / (pace_[g] * pace_[g]));
      peak_[size_.size() + g] = std::max(peak_[size_.size() + g], force);
      // rates of modes as parts of the velocity of a link that turns
      const double turns = std::max(size_of_turn(w.bodies[i].omega), pace_[0]);
      double &of_modes = peak_[pace_.size() + g];
      of_modes = std::max(of_modes, std::sqrt(mass) * sizes_.reach()[i] * turns);
    }
  }
  of_angles = std::max(of_angles, of_ways / sizes_.length());
  inertial_ = std::max(inertial_, inertial);
}

template <class Space> void MotionNorm<Space>::set_peaks(const NormPeaks &peaks) {
  if (peaks.state.size() != peak_.size() || peaks.force.size() != force_peak_.size())
    throw std::invalid_argument("peaks: expected those of the same mechanism, found those of another one");
  peak_ = peaks.state;
  force_peak_ = peaks.force;
  inertial_ = peaks.inertial;
}

template class MotionNorm<Planar>;
template class MotionNorm<Spatial>;

} // namespace ffrobot::recursion
