#include "core/time_function/functions_of_time.h"

#include "core/time_function/jet.h"

#include <algorithm>
#include <cmath>

namespace ffrobot {

namespace {

using Jets = JetOf<FourDoubles>;

Jets all(const Jet &jet) {
  return {FourDoubles{} + jet.value, FourDoubles{} + jet.rate, FourDoubles{} + jet.acceleration};
}

Jet one_of(const Jets &jets, int i) { return {jets.value[i], jets.rate[i], jets.acceleration[i]}; }

[[gnu::always_inline]] inline void make_finite_or_nan(FourDoubles &x) { x = (x - x == 0) ? x : FourDoubles{} + nan; }

bool are_small(const FourDoubles &x) {
  const auto is = (x < largest_of_four_sines) & (x > -largest_of_four_sines);
  return (is[0] & is[1] & is[2] & is[3]) != 0;
}

// By lanes that do not look at each other: the same whatever is evaluated together
void sine_and_cosine(const Jets &u, Jets &sine, Jets &cosine) {
  FourDoubles s, c;
  sines_and_cosines(u.value, s, c);
  if (!are_small(u.value))
    for (int i = 0; i < 4; ++i)
      if (const double x = u.value[i]; !(std::abs(x) < largest_of_four_sines))
        s[i] = std::sin(x), c[i] = std::cos(x);
  sine = chain<FourDoubles>(u, s, c, -s), cosine = chain<FourDoubles>(u, c, -s, -c);
}

} // namespace

FunctionsOfTime::FunctionsOfTime(const std::vector<TimeFunction> &functions)
    : size_(functions.size()), values_{all({0, 1, 0})} {
  for (std::size_t i = 0; i < functions.size(); ++i)
    if (const Expression *expression = functions[i].expression())
      expressions_.emplace_back(i, take(*expression));
    else
      others_.emplace_back(i, functions[i]);
}

// The value of an expression
std::size_t FunctionsOfTime::take(const Expression &expression) {
  std::vector<std::size_t> stack;
  for (const Expression::Instruction &what : expression.program()) {
    if (what.op == Op::time) {
      stack.push_back(0);
    } else if (what.op == Op::constant) {
      stack.push_back(values_.size());
      values_.push_back(all({what.constant, 0, 0}));
    } else {
      const auto first = stack.end() - what.operands();
      const std::array operands{*first, *(stack.end() - (what.operands() == 3 ? 2 : 1)), stack.back()};
      stack.erase(first, stack.end());
      stack.push_back(take(what, operands));
    }
  }
  return stack.back();
}

std::size_t FunctionsOfTime::take(const Expression::Instruction &what, const std::array<std::size_t, 3> &operands) {
  const bool is_cosine = what.op == Op::cos, is_pair = is_cosine || what.op == Op::sin;
  const Op op = is_cosine ? Op::sin : what.op;
  const auto known = std::find_if(parts_.begin(), parts_.end(), [&](const Part &part) {
    return part.operands == operands && part.what.op == op && part.what.constant == what.constant &&
           part.what.takes_constant == what.takes_constant;
  });
  if (known != parts_.end())
    return known->value + is_cosine;
  const std::size_t value = values_.size();
  values_.resize(value + (is_pair ? 2 : 1), Jets{});
  // Of what is no constant, nothing is known yet: zero.
  const double exponent = op == Op::power ? values_[operands[2]].value[0] : 0;
  const int power = is_small_integer(exponent) ? static_cast<int>(exponent) : 0;
  parts_.push_back({{op, what.constant, what.takes_constant}, operands, value, power});
  return value + is_cosine;
}

void FunctionsOfTime::evaluate(const Part &part) {
  const Jets &x = values_[part.operands[0]], &z = values_[part.operands[2]];
  Jets &to = values_[part.value];
  if (part.what.takes_constant)
    to = apply_constant(part.what.op, z, part.what.constant);
  else if (part.power > 0)
    to = integer_power(x, part.power);
  else
    switch (part.what.op) {
    case Op::add:
      to = x + z;
      break;
    case Op::subtract:
      to = x - z;
      break;
    case Op::multiply:
      to = x * z;
      break;
    case Op::divide:
      to = x / z;
      break;
    case Op::negate:
      to = -z;
      break;
    case Op::sin:
      sine_and_cosine(z, to, values_[part.value + 1]);
      break;
    default:
      for (int i = 0; i < together; ++i) {
        const Jet jet = apply(part.what, one_of(x, i), one_of(values_[part.operands[1]], i), one_of(z, i));
        to.value[i] = jet.value, to.rate[i] = jet.rate, to.acceleration[i] = jet.acceleration;
      }
    }
}

void FunctionsOfTime::at(const double *times, int count, Jet *jets) {
  if (!expressions_.empty())
    for (int first = 0; first < count; first += together) {
      const int last = std::min(first + together, count);
      for (int i = 0; i < together; ++i)
        values_[0].value[i] = times[std::min(first + i, last - 1)];
      for (const Part &part : parts_)
        evaluate(part);
      for (const auto &[function, value] : expressions_) {
        Jets known = values_[value];
        make_finite_or_nan(known.value), make_finite_or_nan(known.rate), make_finite_or_nan(known.acceleration);
        for (int i = first; i < last; ++i)
          jets[static_cast<std::size_t>(i) * size_ + function] = one_of(known, i - first);
      }
    }
  for (const auto &[function, law] : others_)
    for (int i = 0; i < count; ++i)
      jets[static_cast<std::size_t>(i) * size_ + function] = law(times[i]);
}

} // namespace ffrobot
