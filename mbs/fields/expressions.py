"""Expressions in t: from their text to the compiled core's `TimeFunction`.

They are read with Python's parser, never evaluated by Python: a whitelist of syntax is translated to the
core's instructions, which carry exact first and second time derivatives.
"""

import ast
import math
import re
from collections.abc import Sequence
from itertools import pairwise
from typing import NoReturn

from .._core import Op, TimeFunction

MAX_LENGTH = 4000  # characters
MAX_NESTING = 60  # parentheses, calls and signs within each other
MAX_LITERAL = 1e100
MAX_EXPONENT = 1000.0

_NAMES = {"t": None, "pi": math.pi, "deg": math.pi / 180, "mm": 1e-3}
_FUNCTIONS = {name: getattr(Op, name) for name in ("sin", "cos", "tan", "exp", "log", "sqrt", "abs", "tanh")}
_OPERATORS: dict[type[ast.operator], Op] = {
    ast.Add: Op.add,
    ast.Sub: Op.subtract,
    ast.Mult: Op.multiply,
    ast.Div: Op.divide,
    ast.Pow: Op.power,
}
_COMPARISONS: dict[type[ast.cmpop], Op] = {
    ast.Lt: Op.less,
    ast.LtE: Op.less_equal,
    ast.Gt: Op.greater,
    ast.GtE: Op.greater_equal,
}
_WORDS = [*_NAMES, *_FUNCTIONS, "where"]


class ExpressionError(ValueError):
    """Signals an expression that violates the grammar; the message has the position, from 1, and the remedy."""

    def __init__(self, text: str, position: int, problem: str, hint: str = "") -> None:
        start = max(0, position - 40)
        excerpt = ("…" if start else "") + text[start : start + 80] + ("…" if start + 80 < len(text) else "")
        message = f"expected an expression in t, found {excerpt!r}: {problem} at character {position}"
        super().__init__(message + (f" ({hint})" if hint else ""))
        self.position = position


ZERO = TimeFunction.constant(0.0)  # what is written as 0


def parse_expression(text: str) -> TimeFunction:
    """Translate `text` to a function of time t (s) with exact first and second derivatives.

    Grammar: `+ - * / **`, parentheses, numbers, `t`, `pi`, the units `deg` (π/180) and `mm` (0.001), `sin cos tan exp
    log sqrt abs tanh`, and `where(condition, a, b)`, whose condition compares by `< <= > >=`, joined by `and`, `or`,
    `not`. Constant parts are evaluated here.

    Raises `ExpressionError` for anything else, for constant parts without a real, finite value (`log(-1)`), and for
    oversize texts, numbers and exponents.
    """
    if len(text) > MAX_LENGTH:
        raise ExpressionError(text, MAX_LENGTH + 1, f"longer than {MAX_LENGTH} characters", "use waypoints")
    # Line breaks are allowed anywhere; a blank for each keeps the positions.
    flat = re.sub(r"\s", " ", text)
    body = flat.lstrip()
    offset = len(flat) - len(body)
    if not body:
        raise ExpressionError(text, 1, "empty")
    try:
        tree = ast.parse(body, mode="eval").body
    except SyntaxError as error:
        is_product = re.search(r"\d\s*(?!e[-+\d])[A-Za-z]|\)\s*[A-Za-z\d]", body)
        hint = "every product needs its *: 2*t" if is_product else ""
        raise ExpressionError(text, offset + (error.offset or 1), error.msg, hint) from None
    except ValueError as error:
        raise ExpressionError(text, 1, str(error)) from None
    except (MemoryError, RecursionError):
        raise ExpressionError(text, 1, "nested too deeply") from None
    translation = _Translation(flat, offset)
    if translation.number(tree, 0):
        return TimeFunction.constant(value) if (value := translation.constants[0]) else ZERO
    try:
        return TimeFunction.expression(translation.ops, translation.constants)
    except ValueError as error:
        raise ExpressionError(text, 1, str(error)) from None


class _Translation:
    """Postfix program of one expression, as it is written down while walking the syntax tree.

    `number` and `condition` append the instructions of a node and return whether it is constant; a constant node
    leaves exactly one `Op.constant`.
    """

    def __init__(self, text: str, offset: int) -> None:
        self.ops: list[Op] = []
        self.constants: list[float] = []
        self._text = text
        self._offset = offset

    def number(self, node: ast.expr, nesting: int) -> bool:
        if nesting > MAX_NESTING:
            self._fail(node, "nested too deeply")
        match node:
            case ast.Constant(value=value):
                if isinstance(value, bool) or not isinstance(value, int | float):
                    self._fail(node, f"{value!r} is not a real number")
                if abs(value) > MAX_LITERAL:
                    self._fail(node, f"a number beyond {MAX_LITERAL:g}")
                self._push(float(value))
                return True
            case ast.Name(id=name):
                return self._name(node, name)
            case ast.UnaryOp(op=ast.UAdd(), operand=operand):
                return self.number(operand, nesting + 1)
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                return self._apply(node, Op.negate, [self.number(operand, nesting + 1)])
            case ast.BinOp():
                return self._chain(node, nesting)
            case ast.Call():
                return self._call(node, nesting)
            case ast.Compare() | ast.BoolOp() | ast.UnaryOp(op=ast.Not()):
                self._fail(node, "a condition where a number is expected", "write where(condition, a, b)")
            case ast.IfExp():
                self._fail(node, "'if' is not available", "write where(condition, a, b)")
            case _:
                self._fail(node, f"{type(node).__name__.lower()} is not part of the grammar")

    def condition(self, node: ast.expr, nesting: int) -> bool:
        if nesting > MAX_NESTING:
            self._fail(node, "nested too deeply")
        match node:
            case ast.Compare(left=left, ops=comparisons, comparators=right):
                constant = True
                for k, (comparison, pair) in enumerate(zip(comparisons, pairwise([left, *right]), strict=True)):
                    op = _COMPARISONS.get(type(comparison))
                    if op is None:
                        name = type(comparison).__name__
                        self._fail(node, f"comparison {name} is not available", "available: < <= > >=")
                    holds = self._apply(node, op, [self.number(operand, nesting + 2) for operand in pair])
                    # a < b < c is a < b and b < c, as Python means it
                    constant = self._apply(node, Op.logical_and, [constant, holds]) if k else holds
                return constant
            case ast.BoolOp(op=operator, values=values):
                op = Op.logical_and if isinstance(operator, ast.And) else Op.logical_or
                constant = self.condition(values[0], nesting + 1)
                for value in values[1:]:
                    constant = self._apply(node, op, [constant, self.condition(value, nesting + 1)])
                return constant
            case ast.UnaryOp(op=ast.Not(), operand=operand):
                return self._apply(node, Op.logical_not, [self.condition(operand, nesting + 1)])
            case _:
                self._fail(node, "where needs a comparison", "such as t < 0.5")

    def _name(self, node: ast.expr, name: str) -> bool:
        if name in _FUNCTIONS or name == "where":
            self._fail(node, f"{name} without its argument", f"write {name}(…)")
        if name not in _NAMES:
            self._fail(node, f"unknown name {name!r}", _suggest(name))
        value = _NAMES[name]
        if value is None:
            self.ops.append(Op.time)
            return False
        self._push(value)
        return True

    def _chain(self, node: ast.BinOp, nesting: int) -> bool:
        """Walk a + b − c … from left to right in a loop, since long sums are not deep nesting."""
        chain = [node]
        while isinstance(left := chain[-1].left, ast.BinOp):
            chain.append(left)
        constant = self.number(left, nesting + 1)
        for link in reversed(chain):
            op = _OPERATORS.get(type(link.op))
            if op is None:
                hint = "a power is written **" if isinstance(link.op, ast.BitXor) else "available: + - * / **"
                self._fail(link, f"operator {type(link.op).__name__} is not available", hint)
            exponent = self.number(link.right, nesting + 1)
            if op == Op.power and exponent and abs(self.constants[-1]) > MAX_EXPONENT:
                self._fail(link.right, f"an exponent beyond {MAX_EXPONENT:g}")
            constant = self._apply(link, op, [constant, exponent])
        return constant

    def _call(self, node: ast.Call, nesting: int) -> bool:
        if not isinstance(node.func, ast.Name):
            self._fail(node, "only functions known by name can be called", "every product needs its *: 2*(t)")
        name = node.func.id
        if name in _NAMES:
            self._fail(node, f"{name} is not a function", f"a product is written {name}*(…)")
        if name not in _FUNCTIONS and name != "where":
            self._fail(node, f"unknown function {name!r}", _suggest(name))
        expected = 3 if name == "where" else 1
        if len(node.args) != expected or node.keywords:
            count = len(node.args) + len(node.keywords)
            self._fail(node, f"{name} takes {expected} argument{'s'[: expected - 1]} without names, found {count}")
        if name == "where":
            constants = [self.condition(node.args[0], nesting + 1)]
            constants += [self.number(argument, nesting + 1) for argument in node.args[1:]]
            return self._apply(node, Op.select, constants)
        return self._apply(node, _FUNCTIONS[name], [self.number(node.args[0], nesting + 1)])

    def _apply(self, node: ast.expr, op: Op, constant: Sequence[bool]) -> bool:
        """Append `op`, or its result when all its operands are constant."""
        self.ops.append(op)
        if not all(constant):
            return False
        count = len(constant)
        # Folded by the core itself, so that a constant means the same as the running program.
        value, _, _ = TimeFunction.expression(self.ops[-count - 1 :], self.constants[-count:])(0.0)
        if math.isnan(value):
            self._fail(node, "no real, finite value")
        del self.ops[-count - 1 :], self.constants[-count:]
        self._push(value)
        return True

    def _push(self, value: float) -> None:
        self.ops.append(Op.constant)
        self.constants.append(value)

    def _fail(self, node: ast.expr, problem: str, hint: str = "") -> NoReturn:
        # Python counts the bytes of UTF-8; users count characters.
        before = self._text[self._offset :].encode()[: node.col_offset].decode(errors="ignore")
        raise ExpressionError(self._text, self._offset + len(before) + 1, problem, hint)


def _suggest(name: str) -> str:
    from difflib import get_close_matches

    close = get_close_matches(name, _WORDS, n=1)
    return f"did you mean {close[0]!r}?" if close else "available: " + " ".join(_WORDS)
