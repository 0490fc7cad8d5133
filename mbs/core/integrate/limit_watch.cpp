#include "core/integrate/limit_watch.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

namespace ffrobot {

using Eigen::Index;

namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double precision = 1e-12; // of a step: where something happens in it

// What Hermite's cubic goes beyond the ends of a step is a guess: that much more, as a part of it, may be true.
constexpr double unsure = 0.5;

bool is_outside(const LimitedCoordinate &limited, double q) { return q < limited.lowest || q > limited.highest; }

// A coordinate at the ends of a step, and its rates there times the step's length.
struct Ends {
  double q0, q1, v0, v1;
};

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

// Dense output is asked where a coordinate turns back beyond all that was seen, and where it first leaves its range.
void LimitWatch::look_at(const LimitedCoordinate &limited, RangeSeen &seen) {
  const Index rate = system_.n_v() + limited.v;
  const double *end = step_.method->end(), h = step_.h;
  const Ends ends{step_.z[limited.v], end[limited.v], h * step_.z[rate], h * end[rate]};
  const Guess guessed = guess(ends);
  const bool turns = guessed.least < seen.least || guessed.largest > seen.largest;
  if (!turns && ends.q1 >= seen.least && ends.q1 <= seen.largest)
    return;
  double before = 0;
  const auto reach = [&](double x, double q) {
    seen.least = std::min(seen.least, q), seen.largest = std::max(seen.largest, q);
    if (!seen.left_at && is_outside(limited, q))
      seen.left_at = step_.t + leave(limited, before, x) * step_.h;
    before = x;
  };
  if (turns) {
    const double middle = guessed.inflection > 0 && guessed.inflection < 1 ? guessed.inflection : 1;
    const double rates[] = {ends.v0, middle < 1 ? between(middle)[rate] : ends.v1, ends.v1};
    for (int part = 0; part < 2; ++part)
      if (rates[part] * rates[part + 1] < 0) {
        const double x = turn(rate, part == 0 ? 0 : middle, part == 0 ? middle : 1);
        reach(x, between(x)[limited.v]);
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

double LimitWatch::turn(Index rate, double begin, double end) {
  const double *at_end = step_.method->end();
  const bool rises = (end < 1 ? between(end) : at_end)[rate] > 0;
  while (end - begin > precision) {
    const double x = std::midpoint(begin, end);
    ((between(x)[rate] > 0) == rises ? end : begin) = x;
  }
  return end;
}

double LimitWatch::leave(const LimitedCoordinate &limited, double begin, double end) {
  while (end - begin > precision) {
    const double x = std::midpoint(begin, end);
    (is_outside(limited, between(x)[limited.v]) ? end : begin) = x;
  }
  return end;
}

} // namespace ffrobot
