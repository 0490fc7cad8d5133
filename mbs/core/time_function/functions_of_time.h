#pragma once

#include "core/time_function/time_function.h"

#include <array>
#include <utility>
#include <vector>

namespace ffrobot {

/// Several functions, evaluated at the same times: what expressions have in common only once, and the sine and the
/// cosine of one argument together. The components of a path are functions of one angle as a rule.
class FunctionsOfTime {
public:
  explicit FunctionsOfTime(const std::vector<TimeFunction> &functions);

  /// At time t, as TimeFunction has them.
  void operator()(double t, Jet *jets);

private:
  /// A value that follows from others; that of a cosine is kept behind that of the sine.
  struct Part {
    Expression::Instruction what;
    std::array<std::size_t, 3> operands; // values, as apply() in jet.h has them
    std::size_t value = 0;
  };
  std::size_t take(const Expression &expression);
  std::size_t take(const Expression::Instruction &what, const std::array<std::size_t, 3> &operands);

  std::vector<Jet> values_; // time, constants and parts
  std::vector<Part> parts_;
  std::vector<std::pair<std::size_t, std::size_t>> expressions_; // functions, and their values
  std::vector<std::pair<std::size_t, TimeFunction>> others_;
};

} // namespace ffrobot
