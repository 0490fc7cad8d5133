#include "core/time_function/time_function.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

namespace ffrobot {

namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

Jet operator+(const Jet &a, const Jet &b) {
  return {a.value + b.value, a.rate + b.rate, a.acceleration + b.acceleration};
}
Jet operator-(const Jet &a, const Jet &b) {
  return {a.value - b.value, a.rate - b.rate, a.acceleration - b.acceleration};
}
Jet operator-(const Jet &a) { return {-a.value, -a.rate, -a.acceleration}; }

Jet operator*(const Jet &a, const Jet &b) {
  return {a.value * b.value, a.rate * b.value + a.value * b.rate,
          a.acceleration * b.value + 2.0 * a.rate * b.rate + a.value * b.acceleration};
}

/// Leibniz' rule on a = q b, solved for q.
Jet operator/(const Jet &a, const Jet &b) {
  const double value = a.value / b.value;
  const double rate = (a.rate - value * b.rate) / b.value;
  return {value, rate, (a.acceleration - 2.0 * rate * b.rate - value * b.acceleration) / b.value};
}

/// Chain rule: f(u(t)) from f, df/du and d²f/du².
Jet chain(const Jet &u, double f, double df, double ddf) {
  return {f, df * u.rate, ddf * u.rate * u.rate + df * u.acceleration};
}

Jet exp(const Jet &u) {
  const double f = std::exp(u.value);
  return chain(u, f, f, f);
}

Jet log(const Jet &u) {
  if (!(u.value > 0.0))
    return {nan, nan, nan};
  return chain(u, std::log(u.value), 1.0 / u.value, -1.0 / (u.value * u.value));
}

Jet sqrt(const Jet &u) {
  const double f = std::sqrt(u.value);
  return chain(u, f, 0.5 / f, -0.25 / (f * u.value));
}

Jet tan(const Jet &u) {
  const double f = std::tan(u.value);
  return chain(u, f, 1.0 + f * f, 2.0 * f * (1.0 + f * f));
}

Jet tanh(const Jet &u) {
  const double f = std::tanh(u.value);
  return chain(u, f, 1.0 - f * f, -2.0 * f * (1.0 - f * f));
}

Jet abs(const Jet &u) {
  // At a zero the first derivative that is not 0 tells the sign just after it.
  const double sign = u.value != 0.0 ? u.value : u.rate != 0.0 ? u.rate : u.acceleration;
  return sign < 0.0 ? -u : u;
}

/// u^n for a small integer n ≥ 2, by squaring: exact where the products are, and several times faster than pow.
Jet integer_power(const Jet &u, int n) {
  double lower = 1.0; // uⁿ⁻²
  double square = u.value;
  for (int rest = n - 2; rest > 0; rest >>= 1, square *= square)
    if (rest & 1)
      lower *= square;
  return chain(u, lower * u.value * u.value, n * lower * u.value, n * (n - 1) * lower);
}

Jet power(const Jet &u, const Jet &exponent) {
  if (exponent.rate != 0.0 || exponent.acceleration != 0.0)
    return exp(exponent * log(u));
  const double n = exponent.value;
  if (n == 0.0)
    return {1.0, 0.0, 0.0};
  if (n == 1.0)
    return u;
  if (n >= 2.0 && n <= 16.0 && n == std::floor(n))
    return integer_power(u, static_cast<int>(n));
  return chain(u, std::pow(u.value, n), n * std::pow(u.value, n - 1.0), n * (n - 1.0) * std::pow(u.value, n - 2.0));
}

Jet truth(bool holds, const Jet &a, const Jet &b) {
  if (std::isnan(a.value) || std::isnan(b.value))
    return {nan, nan, nan};
  return {holds ? 1.0 : 0.0, 0.0, 0.0};
}

Jet select(const Jet &condition, const Jet &a, const Jet &b) {
  if (std::isnan(condition.value))
    return condition;
  return condition.value != 0.0 ? a : b;
}

int operand_count(Op op) {
  switch (op) {
  case Op::constant:
  case Op::time:
    return 0;
  case Op::negate:
  case Op::sin:
  case Op::cos:
  case Op::tan:
  case Op::exp:
  case Op::log:
  case Op::sqrt:
  case Op::abs:
  case Op::tanh:
  case Op::logical_not:
    return 1;
  case Op::select:
    return 3;
  default:
    return 2;
  }
}

double finite_or_nan(double x) { return std::isfinite(x) ? x : nan; }

} // namespace

Expression::Expression(std::span<const Op> program, std::span<const double> constants) {
  int depth = 0;
  std::size_t used = 0;
  for (const Op op : program) {
    if (depth < operand_count(op))
      throw std::invalid_argument("expression: an operator lacks operands");
    depth += 1 - operand_count(op);
    if (depth > max_depth)
      throw std::invalid_argument("expression: nested deeper than " + std::to_string(max_depth) + " operands");
    if (op == Op::constant && used == constants.size())
      throw std::invalid_argument("expression: fewer constants than the program uses");
    program_.push_back({op, op == Op::constant ? constants[used++] : 0.0});
    fold_constants();
    take_constant();
  }
  if (depth != 1)
    throw std::invalid_argument("expression: expected one result, found " + std::to_string(depth));
  if (used != constants.size())
    throw std::invalid_argument("expression: more constants than the program uses");
}

int Expression::Instruction::operands() const { return operand_count(op) - (takes_constant ? 1 : 0); }

// The last instruction, where all its operands are constants and its result is a number.
void Expression::fold_constants() {
  const auto length = program_.back().operands() + 1;
  if (length == 1 || length > std::ssize(program_))
    return;
  const auto begin = program_.end() - length;
  if (!std::all_of(begin, program_.end() - 1, [](const Instruction &i) { return i.op == Op::constant; }))
    return;
  Expression part;
  part.program_.assign(begin, program_.end());
  const Jet jet = part(0.0);
  if (!std::isfinite(jet.value) || jet.rate != 0.0 || jet.acceleration != 0.0)
    return;
  program_.erase(begin, program_.end());
  program_.push_back({Op::constant, jet.value});
}

// The last instruction takes an operand that is constant along: it is not pushed, and has no derivatives to work with.
void Expression::take_constant() {
  Instruction &last = program_.back();
  const bool commutes = last.op == Op::add || last.op == Op::multiply;
  if (!commutes && last.op != Op::subtract && last.op != Op::divide)
    return;
  auto operand = program_.end() - 2; // the second one; then the first, before what the second is made of
  if (operand->op != Op::constant && commutes)
    for (int missing = 1; missing > 0; --operand)
      missing += operand->operands() - 1;
  if (operand->op != Op::constant)
    return;
  int exponent = 0;
  if (last.op == Op::divide && std::abs(std::frexp(operand->constant, &exponent)) == 0.5) // as exact, and faster
    last.op = Op::multiply, operand->constant = 1.0 / operand->constant;
  last.constant = operand->constant, last.takes_constant = true;
  program_.erase(operand);
}

Jet Expression::operator()(double t) const {
  std::array<Jet, max_depth> stack; // what is below the last operand
  Jet *top = stack.data(), a{};     // that operand, in registers
  for (const auto &[op, constant, takes_constant] : program_) {
    switch (op) {
    case Op::constant:
      *top++ = a;
      a = {constant, 0.0, 0.0};
      break;
    case Op::time:
      *top++ = a;
      a = {t, 1.0, 0.0};
      break;
    case Op::add:
      a = takes_constant ? Jet{a.value + constant, a.rate, a.acceleration} : *--top + a;
      break;
    case Op::subtract:
      a = takes_constant ? Jet{a.value - constant, a.rate, a.acceleration} : *--top - a;
      break;
    case Op::multiply:
      a = takes_constant ? Jet{a.value * constant, a.rate * constant, a.acceleration * constant} : *--top * a;
      break;
    case Op::divide:
      a = takes_constant ? Jet{a.value / constant, a.rate / constant, a.acceleration / constant} : *--top / a;
      break;
    case Op::power:
      a = power(*--top, a);
      break;
    case Op::negate:
      a = -a;
      break;
    case Op::sin: {
      const double x = a.value, s = std::sin(x), c = std::cos(x); // one call of sincos
      a = chain(a, s, c, -s);
      break;
    }
    case Op::cos: {
      const double x = a.value, s = std::sin(x), c = std::cos(x);
      a = chain(a, c, -s, -c);
      break;
    }
    case Op::tan:
      a = tan(a);
      break;
    case Op::exp:
      a = exp(a);
      break;
    case Op::log:
      a = log(a);
      break;
    case Op::sqrt:
      a = sqrt(a);
      break;
    case Op::abs:
      a = abs(a);
      break;
    case Op::tanh:
      a = tanh(a);
      break;
    case Op::less:
      --top, a = truth(top->value < a.value, *top, a);
      break;
    case Op::less_equal:
      --top, a = truth(top->value <= a.value, *top, a);
      break;
    case Op::greater:
      --top, a = truth(top->value > a.value, *top, a);
      break;
    case Op::greater_equal:
      --top, a = truth(top->value >= a.value, *top, a);
      break;
    case Op::logical_and:
      --top, a = truth(top->value != 0.0 && a.value != 0.0, *top, a);
      break;
    case Op::logical_or:
      --top, a = truth(top->value != 0.0 || a.value != 0.0, *top, a);
      break;
    case Op::logical_not:
      a = truth(a.value == 0.0, a, a);
      break;
    case Op::select:
      top -= 2, a = select(top[0], top[1], a);
      break;
    }
  }
  return a;
}

PiecewisePolynomial::PiecewisePolynomial(std::vector<double> breaks, std::vector<double> coefficients)
    : breaks_(std::move(breaks)), coefficients_(std::move(coefficients)) {
  const auto finite = [](double x) { return std::isfinite(x); };
  if (breaks_.size() < 2)
    throw std::invalid_argument("piecewise polynomial: expected at least 2 breaks, found " +
                                std::to_string(breaks_.size()));
  const std::size_t intervals = breaks_.size() - 1;
  if (coefficients_.empty() || coefficients_.size() % intervals != 0)
    throw std::invalid_argument("piecewise polynomial: expected the same number of coefficients on each of " +
                                std::to_string(intervals) + " intervals, found " +
                                std::to_string(coefficients_.size()) + " in all");
  if (!std::ranges::all_of(breaks_, finite) || !std::ranges::all_of(coefficients_, finite))
    throw std::invalid_argument("piecewise polynomial: breaks and coefficients must be finite");
  if (!std::ranges::is_sorted(breaks_, std::ranges::less_equal{}))
    throw std::invalid_argument("piecewise polynomial: breaks must increase strictly");
  order_ = coefficients_.size() / intervals;
  // An integrator's last stage may land a few roundings beyond the end of the run.
  margin_ = 1e-9 * (breaks_.back() - breaks_.front());
}

Jet PiecewisePolynomial::operator()(double t) const {
  if (!(t >= breaks_.front() - margin_ && t <= breaks_.back() + margin_))
    return {nan, nan, nan};
  const auto right = std::upper_bound(breaks_.begin() + 1, breaks_.end() - 1, t);
  const std::size_t interval = static_cast<std::size_t>(right - breaks_.begin()) - 1;
  const double *c = coefficients_.data() + interval * order_;
  const double s = t - breaks_[interval];
  // Horner's scheme; rate and acceleration follow by differentiating each of its steps.
  Jet result{c[0], 0.0, 0.0};
  for (std::size_t k = 1; k < order_; ++k) {
    result.acceleration = result.acceleration * s + 2.0 * result.rate;
    result.rate = result.rate * s + result.value;
    result.value = result.value * s + c[k];
  }
  return result;
}

TimeFunction TimeFunction::held(double begin, double end) const {
  return UserFunction([function = *this, begin, end](double t) {
    if (t >= begin && t <= end)
      return function(t);
    return Jet{function(t < begin ? begin : end).value, 0.0, 0.0};
  });
}

Jet TimeFunction::operator()(double t) const {
  const Jet jet = std::visit([t](const auto &function) { return function(t); }, function_);
  return {finite_or_nan(jet.value), finite_or_nan(jet.rate), finite_or_nan(jet.acceleration)};
}

} // namespace ffrobot
