#include "core/time_function/time_function.h"
#include "core/time_function/jet.h"

#include <algorithm>
#include <array>
#include <stdexcept>
#include <string>

namespace ffrobot {

namespace {

int operand_count(Op op) {
  if (op <= Op::time)
    return 0;
  if (op == Op::select)
    return 3;
  return op == Op::logical_not || (op >= Op::negate && op <= Op::tanh) ? 1 : 2;
}

} // namespace

Expression::Expression(std::span<const Op> program, std::span<const double> constants) {
  int depth = 0;
  std::size_t used = 0;
  const auto require = [](bool is_met) {
    if (!is_met)
      throw std::invalid_argument("expression: malformed program");
  };
  for (const Op op : program) {
    require(depth >= operand_count(op) && (op != Op::constant || used < constants.size()));
    depth += 1 - operand_count(op);
    if (depth > max_depth)
      throw std::invalid_argument("expression: nested deeper than " + std::to_string(max_depth) + " operands");
    program_.push_back({op, op == Op::constant ? constants[used++] : 0.0});
    fold_constants();
    take_constant();
  }
  require(depth == 1 && used == constants.size());
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
  last.constant = operand->constant, last.takes_constant = true;
  program_.erase(operand);
}

Jet Expression::operator()(double t) const {
  std::array<Jet, max_depth> stack; // what is below the last operand
  Jet *top = stack.data(), a{};     // that operand, in registers
  for (const Instruction &i : program_)
    switch (i.operands()) {
    case 0:
      *top++ = a;
      a = i.op == Op::time ? Jet{t, 1.0, 0.0} : Jet{i.constant, 0.0, 0.0};
      break;
    case 1:
      a = apply(i, a, a, a);
      break;
    case 2:
      --top, a = apply(i, *top, a, a);
      break;
    default:
      top -= 2, a = apply(i, top[0], top[1], a);
    }
  return a;
}

PiecewisePolynomial::PiecewisePolynomial(std::vector<double> breaks, std::vector<double> coefficients)
    : breaks_(std::move(breaks)), coefficients_(std::move(coefficients)) {
  const auto finite = [](double x) { return std::isfinite(x); };
  const std::size_t intervals = breaks_.size() - 1;
  if (breaks_.size() < 2 || coefficients_.empty() || coefficients_.size() % intervals != 0 ||
      !std::ranges::all_of(breaks_, finite) || !std::ranges::all_of(coefficients_, finite) ||
      !std::ranges::is_sorted(breaks_, std::ranges::less_equal{}))
    throw std::invalid_argument("piecewise polynomial: malformed breaks or coefficients");
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
  return finite_or_nan(std::visit([t](const auto &function) { return function(t); }, function_));
}

} // namespace ffrobot
