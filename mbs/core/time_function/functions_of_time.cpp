#include "core/time_function/functions_of_time.h"

#include "core/time_function/jet.h"

#include <algorithm>

namespace ffrobot {

namespace {

using Jets = JetOf<FourDoubles>;

Jets all(const Jet &jet) {
  return {FourDoubles{} + jet.value, FourDoubles{} + jet.rate, FourDoubles{} + jet.acceleration};
}

Jet one_of(const Jets &jets, std::size_t i) { return {jets.value[i], jets.rate[i], jets.acceleration[i]}; }
void put(const Jet &jet, Jets &to, std::size_t i) {
  to.value[i] = jet.value, to.rate[i] = jet.rate, to.acceleration[i] = jet.acceleration;
}

[[gnu::always_inline]] inline void make_finite_or_nan(FourDoubles &x) { x = (x - x == 0) ? x : FourDoubles{} + nan; }

// By lanes that do not look at each other: the same whatever is evaluated together
void sine_and_cosine(const Jets &u, Jets &sine, Jets &cosine) {
  double values[8];
  sines_and_cosines(u.value, values, values + 4);
  const auto s = read_at<FourDoubles>(values), c = read_at<FourDoubles>(values + 4);
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
  const Op op = part.what.op;
  if (part.what.takes_constant)
    to = apply_constant(op, z, part.what.constant);
  else if (part.power > 0)
    to = integer_power(x, part.power);
  else if (op == Op::sin)
    sine_and_cosine(z, to, values_[part.value + 1]);
  else if (op < Op::power || op == Op::negate || op >= Op::less)
    to = apply_simple(op, x, values_[part.operands[1]], z);
  else
    for (std::size_t i = 0; i < together; ++i)
      put(apply(part.what, one_of(x, i), one_of(values_[part.operands[1]], i), one_of(z, i)), to, i);
}

void FunctionsOfTime::find(const double *times, int count) {
  const std::size_t size = count;
  fours_ = (size + together - 1) / together;
  if (found_.size() < fours_ * size_)
    found_.resize(fours_ * size_);
  for (std::size_t first = 0; first < size; first += together) {
    Jets *to = found_.data() + first / together * size_;
    FourDoubles &time = values_[0].value;
    for (std::size_t i = 0; i < together; ++i)
      time[i] = times[std::min(first + i, size - 1)];
    for (const Part &part : parts_)
      evaluate(part);
    for (const auto &[function, value] : expressions_) {
      Jets jets = values_[value];
      make_finite_or_nan(jets.value), make_finite_or_nan(jets.rate), make_finite_or_nan(jets.acceleration);
      to[function] = jets;
    }
    for (const auto &[function, law] : others_)
      for (std::size_t i = 0; i < std::min(together, size - first); ++i)
        put(law(times[first + i]), to[function], i);
  }
}

void FunctionsOfTime::accelerations(const double *sign, std::vector<double> &to) const {
  if (to.size() < fours_ * together * size_)
    to.resize(fours_ * together * size_);
  for (std::size_t four = 0; four < fours_; ++four)
    for (std::size_t function = 0; function < size_; ++function) {
      const FourDoubles now = sign[function] * found_[four * size_ + function].acceleration;
      double *first = to.data() + four * together * size_ + function;
      first[0] = now[0], first[size_] = now[1], first[2 * size_] = now[2], first[3 * size_] = now[3];
    }
}

} // namespace ffrobot
