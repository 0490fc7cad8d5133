#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <variant>
#include <vector>

namespace ffrobot {

/// A function of time at one instant, with its exact first and second time derivative; of several numbers T at as many
/// instants.
template <class T> struct JetOf {
  T value;
  T rate;
  T acceleration;
};
using Jet = JetOf<double>;

/// Instructions of an Expression. Operands stand on the stack in the order in which they are written.
enum class Op : std::uint8_t {
  constant, // pushes the next entry of the list of constants
  time,     // pushes t
  add,
  subtract,
  multiply,
  divide,
  power, // constant integer exponents are exact for any base; all others need a positive base
  negate,
  sin,
  cos,
  tan,
  exp,
  log,
  sqrt,
  abs, // at a zero of its operand: the derivatives from the right, in the direction of time
  tanh,
  less, // comparisons and logic give 1 or 0, with zero derivatives
  less_equal,
  greater,
  greater_equal,
  logical_and,
  logical_or,
  logical_not,
  select, // condition, a, b → a where the condition is not 0, else b; the other branch may be NaN
};

/// The same value at all times.
class Constant {
public:
  explicit Constant(double value) : value_(value) {}
  Jet operator()(double) const { return {value_, 0.0, 0.0}; }

private:
  double value_;
};

/// A postfix program over jets: derivatives are propagated by Taylor arithmetic, so they are exact.
/// Evaluation allocates nothing.
class Expression {
public:
  static constexpr int max_depth = 64;

  struct Instruction {
    Op op;
    double constant = 0;
    bool takes_constant = false; // in place of an operand: of the second one, or of either of a sum or a product

    int operands() const;
  };

  /// Throws std::invalid_argument unless the program leaves exactly one value, stays within `max_depth` and
  /// uses exactly the given constants.
  Expression(std::span<const Op> program, std::span<const double> constants);

  Jet operator()(double t) const;

  const std::vector<Instruction> &program() const { return program_; }

private:
  Expression() = default;
  void fold_constants();
  void take_constant();

  std::vector<Instruction> program_;
};

/// Polynomials between breaks, in powers of (t − left break).
///
/// It is defined on [first break, last break], plus a margin for rounding; NaN elsewhere. Neither clamping nor
/// extrapolating would be right: the one jumps in velocity, the other runs away.
class PiecewisePolynomial {
public:
  /// Breaks (k+1), strictly increasing; coefficients (k × order), interval by interval, highest power first.
  /// Throws std::invalid_argument on anything else, and on numbers that are not finite.
  PiecewisePolynomial(std::vector<double> breaks, std::vector<double> coefficients);

  Jet operator()(double t) const;

private:
  std::vector<double> breaks_;
  std::vector<double> coefficients_;
  std::size_t order_;
  double margin_;
};

/// A function of the user's: `compiled` writes value, rate and acceleration to its second argument.
class UserFunction {
public:
  using Compiled = void (*)(double, double *);

  explicit UserFunction(std::function<Jet(double)> function) : function_(std::move(function)) {}
  explicit UserFunction(Compiled compiled)
      : function_([compiled](double t) {
          double out[3] = {};
          compiled(t, out);
          return Jet{out[0], out[1], out[2]};
        }) {}

  Jet operator()(double t) const { return function_(t); }

private:
  std::function<Jet(double)> function_;
};

/// Any prescribed function of time. Components that are not finite (domain error, overflow, out of range) are NaN:
/// callers check.
class TimeFunction {
public:
  TimeFunction(Constant function) : function_(function) {}
  TimeFunction(Expression function) : function_(std::move(function)) {}
  TimeFunction(PiecewisePolynomial function) : function_(std::move(function)) {}
  TimeFunction(UserFunction function) : function_(std::move(function)) {}

  Jet operator()(double t) const;

  /// The same between `begin` and `end`, and at rest with its values there outside.
  TimeFunction held(double begin, double end) const;

  const Expression *expression() const { return std::get_if<Expression>(&function_); } // null where it is none

private:
  std::variant<Constant, Expression, PiecewisePolynomial, UserFunction> function_;
};

} // namespace ffrobot
