#include "core/time_function/functions_of_time.h"

#include "core/time_function/jet.h"

#include <algorithm>

namespace ffrobot {

FunctionsOfTime::FunctionsOfTime(const std::vector<TimeFunction> &functions) : values_{{0, 1, 0}} {
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
      values_.push_back({what.constant, 0, 0});
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
  values_.resize(value + (is_pair ? 2 : 1));
  parts_.push_back({{op, what.constant, what.takes_constant}, operands, value});
  return value + is_cosine;
}

void FunctionsOfTime::operator()(double t, Jet *jets) {
  values_[0].value = t;
  for (const auto &[what, operands, value] : parts_)
    if (what.op == Op::sin)
      sine_and_cosine(values_[operands[2]], values_[value], values_[value + 1]);
    else
      values_[value] = apply(what, values_[operands[0]], values_[operands[1]], values_[operands[2]]);
  for (const auto &[function, value] : expressions_)
    jets[function] = finite_or_nan(values_[value]);
  for (const auto &[function, law] : others_)
    jets[function] = law(t);
}

} // namespace ffrobot
