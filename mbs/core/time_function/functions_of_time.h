#pragma once

#include "core/recursion/numbers/sines.h"
#include "core/time_function/time_function.h"

#include <array>
#include <utility>

namespace ffrobot {

/// Several functions, evaluated at the same times: what expressions have in common only once, the sine and the cosine
/// of one argument together, and at four times at once. The components of a path are functions of one angle as a rule.
class FunctionsOfTime {
public:
  explicit FunctionsOfTime(const std::vector<TimeFunction> &functions);

  /// At several times (count), as TimeFunction has them but for rounding; the same as at one time alone. They are kept,
  /// four times side by side, until the next call.
  void find(const double *times, int count);

  /// Of what find() found at the time number i
  Jet jet(std::size_t i, std::size_t function) const {
    const JetOf<FourDoubles> &jets = found_[i / together * size_ + function];
    return {jets.value[i % together], jets.rate[i % together], jets.acceleration[i % together]};
  }
  /// Times `sign` (functions), of all these times: (times, functions)
  void accelerations(const double *sign, std::vector<double> &to) const;

private:
  static constexpr std::size_t together = 4;
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

  std::size_t size_, fours_ = 0; // functions; of times
  std::vector<Jets> found_;      // (fours of times, functions)
  std::vector<Jets> values_;     // time, constants and parts
  std::vector<Part> parts_;
  std::vector<std::pair<std::size_t, std::size_t>> expressions_; // functions, and their values
  std::vector<std::pair<std::size_t, TimeFunction>> others_;
};

} // namespace ffrobot
