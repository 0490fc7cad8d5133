#include "core/integrate/limit_watch.h"

#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

namespace ffrobot {

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double precision = 1e-12; // of a step: where something happens in it

// What Hermite's cubic goes beyond the ends of a step is a guess: that much more, as a part of it, may be true.
constexpr double unsure = 0.5;

bool is_outside(const LimitedCoordinate &limited, double q) { return q < limited.lowest || q > limited.highest; }

// A coordinate at the ends of a step, its rates there times the step's length h, and accelerations times h^2.
struct Ends {
  double q0, q1, v0, v1, a0, a1;
};

struct Value {
  double q, rate;
};

// Hermite's polynomial of degree 5 through them
Value between_ends(const Ends &e, double x) {
  const double d = e.q1 - e.q0 - e.v0 - e.a0 / 2, dv = e.v1 - e.v0 - e.a0, da = e.a1 - e.a0;
  const double c3 = 10 * d - 4 * dv + da / 2, c4 = -15 * d + 7 * dv - da, c5 = 6 * d - 3 * dv + da / 2;
  return {e.q0 + x * (e.v0 + x * (e.a0 / 2 + x * (c3 + x * (c4 + x * c5)))),
          e.v0 + x * (e.a0 + x * (3 * c3 + x * (4 * c4 + x * 5 * c5)))};
}

// Of a step, with the rates at its ends
struct Part {
  double from, to, first, last;
};

// Where the rate of `at` changes from one sign, that of `first`, to the other
template <class At> double turning_point(const At &at, double first, double begin, double end) {
  while (end - begin > precision) {
    const double x = std::midpoint(begin, end);
    (at(x).rate * first > 0 ? begin : end) = x;
  }
  return end;
}

// Of the cubic through them: what is reached where it turns back, and the part of the step, which may lie outside,
// where its rate is largest or smallest.
struct Guess {
  double least = infinity, largest = -infinity; // infinite where it does not turn back
  double inflection;
};

Guess guess(const Ends &e) {
  const double way = e.q1 - e.q0;
  const double b = 2 * (3 * way - 2 * e.v0 - e.v1), c = 3 * (e.v0 + e.v1 - 2 * way); // rate v0 + b x + c x^2
  Guess found{.inflection = -b / (2 * c)};
  const double square = b * b - 4 * e.v0 * c;
  if (!(square > 0))
    return found;
  const double s = -0.5 * (b + std::copysign(std::sqrt(square), b)), low = std::min(e.q0, e.q1),
               high = std::max(e.q0, e.q1);
  for (const double x : {s / c, e.v0 / s}) {
    if (!(x > 0 && x < 1))
      continue;
    const double q = e.q0 + x * (e.v0 + x * (b / 2 + x * c / 3));
    found.least = std::min(found.least, q - unsure * std::max(low - q, 0.0));
    found.largest = std::max(found.largest, q + unsure * std::max(q - high, 0.0));
  }
  return found;
}

} // namespace

LimitWatch::LimitWatch(std::vector<LimitedCoordinate> limited, const OdeSystem &system, OdeSystem &other)
    : limited_(std::move(limited)), system_(system), other_(other), z_(system.size()) {}

void LimitWatch::begin(double t, const double *z) {
  seen_.clear();
  for (const LimitedCoordinate &limited : limited_) {
    const double q = z[limited.v];
    seen_.push_back({q, q, is_outside(limited, q) ? std::optional(t) : std::nullopt});
  }
}

void LimitWatch::look(Method &method, const MethodChoice &choice, double t, const double *z, double h) {
  step_ = {&method, &choice, t, z, h};
  dense_ = nullptr;
  for (std::size_t k = 0; k < limited_.size(); ++k)
    look_at(limited_[k], seen_[k]);
}

// A coordinate that only moves on costs a comparison. Where it turns back beyond all that was seen, how far it goes is
// read off the ends of the step, or off dense output: where that is to be had, or it may be outside. Dense output tells
// when it first leaves its range.
void LimitWatch::look_at(const LimitedCoordinate &limited, RangeSeen &seen) {
  const Index v = limited.v, rate = system_.n_v() + v;
  Method &method = *step_.method;
  const double *end = method.end(), h = step_.h;
  Ends ends{step_.z[v], end[v], h * step_.z[rate], h * end[rate], 0, 0};
  const Guess guessed = guess(ends);
  const bool turns = guessed.least < seen.least || guessed.largest > seen.largest;
  if (!turns && ends.q1 >= seen.least && ends.q1 <= seen.largest)
    return;
  double before = 0;
  const auto reach = [&](double x, double q) {
    seen.least = std::min(seen.least, q), seen.largest = std::max(seen.largest, q);
    if (!seen.left_at && is_outside(limited, q))
      seen.left_at = step_.t + leave(limited, before, x) * h;
    before = x;
  };
  if (turns) {
    ends.a0 = h * h * method.first_slope()[rate], ends.a1 = h * h * method.last_slope()[rate];
    const bool is_dense =
        !method.needs_slopes_between() || is_outside(limited, guessed.least) || is_outside(limited, guessed.largest);
    const auto at = [&](double x) {
      if (!is_dense)
        return between_ends(ends, x);
      const double *z = between(x);
      return Value{z[v], z[rate]};
    };
    const bool is_split = guessed.inflection > 0 && guessed.inflection < 1;
    const double middle = is_split ? guessed.inflection : 1, in_middle = is_split ? at(middle).rate : ends.v1;
    for (const auto &[from, to, first, last] : {Part{0, middle, ends.v0, in_middle}, {middle, 1, in_middle, ends.v1}})
      if (first * last < 0) {
        const double x = turning_point(at, first, from, to);
        reach(x, at(x).q);
      }
  }
  reach(1, ends.q1);
}

void LimitWatch::prepare_dense() {
  const auto &[method, choice, t, z, h] = step_;
  dense_ = method;
  if (method->needs_slopes_between()) {
    if (!again_ || kind_of_again_ != choice->kind)
      again_ = make_method(*choice, other_), kind_of_again_ = choice->kind;
    const Index n = system_.size();
    other_.local().set_centre(system_.local().state(z));
    std::copy_n(method->first_slope(), n, again_->first_slope());
    again_->step(t, z, h, 0);
    std::copy_n(method->end(), n, again_->end());
    std::copy_n(method->last_slope(), n, again_->last_slope());
    dense_ = again_.get();
  }
  dense_->prepare_dense(t, z, h);
}

const double *LimitWatch::between(double x) {
  if (!dense_)
    prepare_dense();
  dense_->interpolate(step_.t + x * step_.h, z_.data());
  return z_.data();
}

double LimitWatch::leave(const LimitedCoordinate &limited, double begin, double end) {
  while (end - begin > precision) {
    const double x = std::midpoint(begin, end);
    (is_outside(limited, between(x)[limited.v]) ? end : begin) = x;
  }
  return end;
}

} // namespace ffrobot
