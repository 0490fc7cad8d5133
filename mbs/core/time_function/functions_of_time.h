#pragma once

#include "core/linear/sines.h"
#include "core/time_function/time_function.h"

#include <array>
#include <utility>
#include <vector>

namespace ffrobot {

/// Several functions, evaluated at the same times: what expressions have in common only once, the sine and the cosine
/// of one argument together, and at four times at once. The components of a path are functions of one angle as a rule.
class FunctionsOfTime {
public:
  explicit FunctionsOfTime(const std::vector<TimeFunction> &functions);

  /// At time t, as TimeFunction has them but for rounding.
  void operator()(double t, Jet *jets) { at(&t, 1, jets); }

  /// At several times (count): jets (count, functions), the same as one by one.
  void at(const double *times, int count, Jet *jets);

private:
  static constexpr int together = 4;
  using Jets = JetOf<FourDoubles>;

  /// A value that follows from others; that of a cosine is kept behind that of the sine.
  struct Part {
    Expression::Instruction what;
    std::array<std::size_t, 3> operands; // values, as apply() in jet.h has them
    std::size_t value = 0;
    int power = 0; // a small integer to which the first operand is raised; 0: it is none
  };
  std::size_t take(const Expression &expression);
  std::size_t take(const Expression::Instruction &what, const std::array<std::size_t, 3> &operands);
  void evaluate(const Part &part);

  std::size_t size_;
  std::vector<Jets> values_; // time, constants and parts
  std::vector<Part> parts_;
  std::vector<std::pair<std::size_t, std::size_t>> expressions_; // functions, and their values
  std::vector<std::pair<std::size_t, TimeFunction>> others_;
};

} // namespace ffrobot
