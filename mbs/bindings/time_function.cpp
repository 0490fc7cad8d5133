#include "core/time_function/functions_of_time.h"

#include <nanobind/eigen/dense.h>
#include <nanobind/stl/function.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include "bindings/bindings.h"

namespace {

// Coefficients (k, order), interval by interval, as the core keeps them
TimeFunction polynomial(const VectorXd &breaks, const RowMajor &coefficients) {
  if (coefficients.rows() + 1 != breaks.size())
    throw nb::value_error("polynomial: expected coefficients (k, order) for k + 1 breaks");
  return PiecewisePolynomial({breaks.begin(), breaks.end()},
                             {coefficients.data(), coefficients.data() + coefficients.size()});
}

TimeFunction python_function(const std::function<std::tuple<double, double, double>(double)> &function) {
  return UserFunction([function](double t) {
    const auto [value, rate, acceleration] = function(t);
    return Jet{value, rate, acceleration};
  });
}

TimeFunction compiled_function(std::uintptr_t address) {
  return UserFunction(reinterpret_cast<UserFunction::Compiled>(address));
}

RowMajor sample(const TimeFunction &function, const VectorXd &times) {
  RowMajor found(3, times.size());
  FunctionsOfTime functions({function});
  for (Index first = 0, count; first < times.size(); first += count) {
    count = std::min<Index>(times.size() - first, 256); // whose jets stay in the cache
    functions.find(times.data() + first, static_cast<int>(count));
    for (Index i = 0; i < count; ++i) {
      const Jet jet = functions.jet(i, 0);
      found.col(first + i) << jet.value, jet.rate, jet.acceleration;
    }
  }
  return found;
}

// Times at which comparisons of t with a number change, in the order of the expression.
std::vector<double> switches(const TimeFunction &function) {
  std::vector<double> found;
  if (function.expression() == nullptr)
    return found;
  const std::vector<Expression::Instruction> &program = function.expression()->program();
  for (std::size_t k = 2; k < program.size(); ++k) {
    if (program[k].op < Op::less || program[k].op > Op::greater_equal)
      continue;
    const Expression::Instruction &left = program[k - 2], &right = program[k - 1];
    if (left.op == Op::time && right.op == Op::constant)
      found.push_back(right.constant);
    if (left.op == Op::constant && right.op == Op::time)
      found.push_back(left.constant);
  }
  return found;
}

} // namespace

void bind_time_function(nb::module_ &m) {
  bind_values(nb::enum_<Op>(m, "Op", "Instructions of an expression in postfix order."),
              FFROBOT_VALUES(Op, constant, time, add, subtract, multiply, divide, power, negate, sin, cos, tan, exp,
                             log, sqrt, abs, tanh, less, less_equal, greater, greater_equal, logical_and, logical_or,
                             logical_not, select));
  nb::class_<TimeFunction>(m, "TimeFunction",
                           "A function of time with exact first and second derivatives; NaN where it has none.")
      .def_static(
          "constant", [](double value) -> TimeFunction { return Constant(value); }, "value"_a)
      .def_static(
          "expression",
          [](const std::vector<Op> &ops, const std::vector<double> &constants) -> TimeFunction {
            return Expression(ops, constants);
          },
          "ops"_a, "constants"_a, "Postfix program; raises ValueError when it is malformed or too deep.")
      .def_static("polynomial", &polynomial, "breaks"_a, "coefficients"_a,
                  "Breaks (k+1,) and coefficients (k, order), highest power first, in powers of t − left break.")
      .def_static("python", &python_function, "function"_a,
                  "A callable of t (s) that returns (value, rate, acceleration).")
      .def_static("compiled", &compiled_function, "address"_a,
                  "Address of a C function void(double t, double *value_rate_acceleration).")
      .def("held", &TimeFunction::held, "begin"_a, "end"_a,
           "The function between `begin` and `end` (s), constant before and after.")
      .def(
          "__call__",
          [](const TimeFunction &function, double t) {
            const Jet jet = function(t);
            return std::tuple(jet.value, jet.rate, jet.acceleration);
          },
          "t"_a, "(value, rate, acceleration) at time t (s).")
      .def("switches", &switches, "Times (s) at which comparisons of t with a number change.")
      .def("sample", &sample, "t"_a, "Value, rate and acceleration (3, T) at the times t (T,).");
}
