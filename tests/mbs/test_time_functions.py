"""Time functions: exact derivatives, Python's semantics, and nothing but the grammar."""

import math
import random
import time

import numpy as np
import pytest

from ffrobot.common.errors import InputError
from ffrobot.mbs._core import TimeFunction
from ffrobot.mbs.fields.expressions import ExpressionError, parse_expression
from ffrobot.mbs.fields.waypoints import load_waypoints

# Expression and its value, first and second derivative, worked out by hand.
CLOSED_FORMS = [
    ("3", lambda t: (3.0, 0.0, 0.0)),
    ("t", lambda t: (t, 1.0, 0.0)),
    ("-t**2", lambda t: (-t * t, -2 * t, -2.0)),
    ("t**5", lambda t: (t**5, 5 * t**4, 20 * t**3)),
    ("t**-1", lambda t: (1 / t, -1 / t**2, 2 / t**3)),
    ("t**2.5", lambda t: (t**2.5, 2.5 * t**1.5, 3.75 * t**0.5)),
    ("2**t", lambda t: (2**t, math.log(2) * 2**t, math.log(2) ** 2 * 2**t)),
    ("t**t", lambda t: (t**t, t**t * (math.log(t) + 1), t**t * ((math.log(t) + 1) ** 2 + 1 / t))),
    ("1.5*cos(pi*t/4)", lambda t: (1.5 * (c := math.cos(w * t)), -1.5 * w * math.sin(w * t), -1.5 * w * w * c)),
    ("t*exp(-t)", lambda t: (t * math.exp(-t), (1 - t) * math.exp(-t), (t - 2) * math.exp(-t))),
    ("1/(1 + t**2)", lambda t: (q := 1 / (1 + t * t), -2 * t * q**2, (6 * t * t - 2) * q**3)),
    ("log(t)", lambda t: (math.log(t), 1 / t, -1 / t**2)),
    ("sqrt(t)", lambda t: (t**0.5, 0.5 * t**-0.5, -0.25 * t**-1.5)),
    ("tan(t)", lambda t: ((f := math.tan(t)), 1 + f * f, 2 * f * (1 + f * f))),
    ("tanh(t)", lambda t: ((f := math.tanh(t)), 1 - f * f, -2 * f * (1 - f * f))),
    ("3 - (t - 2)/-8", lambda t: (3 + (t - 2) / 8, 0.125, 0.0)),
    ("7*(1 + t**2/3)", lambda t: (7 + 7 * t * t / 3, 14 * t / 3, 14 / 3)),
    ("abs(-t)", lambda t: (t, 1.0, 0.0)),
    ("30*deg + 750*mm*t", lambda t: (math.pi / 6 + 0.75 * t, 0.75, 0.0)),
    ("where(t < 1, t, t**2)", lambda t: (t, 1.0, 0.0) if t < 1 else (t**2, 2 * t, 2.0)),
]  # fmt: skip
w = math.pi / 4


@pytest.mark.parametrize(("text", "exact"), CLOSED_FORMS, ids=[text for text, _ in CLOSED_FORMS])
@pytest.mark.parametrize("t", [0.3, 1.0, 1.7])
def test_derivatives_are_exact(text, exact, t):
    np.testing.assert_allclose(parse_expression(text)(t), exact(t), rtol=4e-15, atol=4e-15)


def random_expression(rng, depth):
    """A smooth expression that is safe for all t in [0, 1], and the same text for Python."""
    if depth == 0:
        return rng.choice(["t", "pi", f"{rng.uniform(-2, 2):.3f}", "1e-3"])
    a, b = (random_expression(rng, depth - 1) for _ in range(2))
    forms = ["({a} + {b})", "({a} - {b})", "{a}*{b}", "({a})/(2 + ({b})**2)", "sin({a})", "cos({a})", "tanh({a})"]
    forms += [
        "exp(-({a})**2)",
        "log(1 + ({a})**2)",
        "sqrt(1 + ({b})**2)",
        "-({a})",
        "({a})**3",
        "(2 + cos({a}))**({b})",
    ]
    forms += ["where({a} < {b}, {a}, {b})", "where(not {a} > 1 and {b} >= 0 or t <= 0.5, {a}, {b})", "abs({a})"]
    return rng.choice(forms).format(a=a, b=b)


@pytest.mark.parametrize("seed", range(60))
def test_random_expressions_agree_with_python(seed):
    rng = random.Random(seed)
    text = random_expression(rng, 3)
    names = {name: getattr(math, name) for name in ("sin", "cos", "tanh", "exp", "log", "sqrt", "pi")}
    names |= {"abs": abs, "where": lambda condition, a, b: a if condition else b}
    function = parse_expression(text)
    for t in (0.0, 0.37, 1.0):
        expected = eval(text, {"__builtins__": {}}, names | {"t": t})
        assert function(t)[0] == pytest.approx(expected, rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("seed", range(60))
def test_random_expressions_have_the_derivatives_of_their_values(seed):
    function = parse_expression(random_expression(random.Random(seed), 3))
    t, h = 0.3712, 1e-3
    # Sixth-order central differences; the rate's own difference tests the acceleration.
    samples = function.sample(t + h * np.arange(-3, 4))
    weights = np.array([-1, 9, -45, 0, 45, -9, 1]) / (60 * h)
    if np.ptp(samples[2]) > 1e3:
        pytest.skip("a kink of abs or where, or a large higher derivative, within the stencil")
    scale = 1 + np.abs(samples).max(axis=1)
    assert samples[0] @ weights == pytest.approx(samples[1, 3], abs=1e-8 * scale[0] * scale[2])
    assert samples[1] @ weights == pytest.approx(samples[2, 3], abs=1e-8 * scale[0] * scale[2])


NAN = math.nan
AT_ONE_TIME = [
    ("where(t < 1, 1/(1 - t), 0)", 1.0, (0.0, 0.0, 0.0)),  # the branch that is not selected does not leak
    ("where(t > 0, sqrt(t), t**2)", 0.0, (0.0, 0.0, 2.0)),
    *(("where(0.2 < t <= 0.5 or not t < 0.9, 1, 0)", t, (k, 0.0, 0.0))
      for t, k in ((0.2, 0.0), (0.3, 1.0), (0.5, 1.0), (0.6, 0.0), (0.9, 1.0))),
    *((f"t**{n}", 0.0, (float(n == 0), float(n == 1), 2.0 * (n == 2))) for n in range(7)),
    ("abs(t)", 0.0, (0.0, 1.0, 0.0)),  # forward in time
    ("abs(-t**2)", 0.0, (0.0, 0.0, 2.0)),
    ("log(t)", -1.0, (NAN, NAN, NAN)),  # outside the domain, by component
    ("1/t", 0.0, (NAN, NAN, NAN)),
    ("(t - 2)**0.5", 1.0, (NAN, NAN, NAN)),
    ("sqrt(t)", 0.0, (0.0, NAN, NAN)),
]  # fmt: skip


@pytest.mark.parametrize(("text", "t", "expected"), AT_ONE_TIME)
def test_conditions_kinks_and_domains(text, t, expected):
    np.testing.assert_array_equal(parse_expression(text)(t), expected)


def test_constants_among_themselves_mean_what_they_do_with_t():
    """Folded when the expression is read; the same with a zero that depends on t."""
    folded, not_folded = (f"1 + (cos(pi/4 + {zero}) - sqrt(3 + {zero})/2)*t**(1 + {zero} + 1)" for zero in ("0", "0*t"))
    np.testing.assert_array_equal(parse_expression(folded)(1.7), parse_expression(not_folded)(1.7))


BAD_EXPRESSIONS = [
    ("", 1, "empty"),
    ("t +", None, "syntax"),
    ("2*tt", 3, "did you mean 't'"),
    ("1.5*cosh(t)", 5, "did you mean 'cos'"),
    ("2t", None, "2*t"),
    ("t^2", 1, r"written \*\*"),
    ("sin", 1, "without its argument"),
    ("pi(t)", 1, "not a function"),
    ("sin(t, t)", 1, "takes 1 argument"),
    ("sin(x=t)", 1, "without names"),
    ("where(t, 1, 2)", 7, "comparison"),
    ("where(t == 1, 1, 2)", 7, "< <= > >="),
    ("t < 1", 1, "where"),
    ("t.real", 1, "attribute"),
    ("__import__('os')", 1, "unknown function"),
    ("'a'", 1, "not a real number"),
    ("1e400", 1, "beyond"),
    ("9**9**9**9", 7, "exponent"),
    ("t**2000", 4, "exponent"),
    ("1 + log(-1)", 5, "no real, finite value"),
    ("t/(1 - 1)*0 + 1/0", 15, "no real, finite value"),
    ("t\0", 1, "null"),
    ("é*t", 1, "unknown name"),
    ("ｐｉ + xx", 6, "unknown name 'xx'"),  # Python reads wide letters as pi; positions count characters, not bytes
    ("t" * 1_000_000, None, "longer"),
    ("(" * 1000 + "t" + ")" * 1000, None, "parentheses"),
    ("(t+" * 55 + "t*(" * 40 + "t" + ")" * 95, None, "deep"),
]


@pytest.mark.parametrize(
    ("text", "position", "says"), BAD_EXPRESSIONS, ids=[text[:20] for text, _, _ in BAD_EXPRESSIONS]
)
def test_everything_else_is_refused_at_once(text, position, says):
    start = time.process_time()
    with pytest.raises(ExpressionError, match=says) as caught:
        parse_expression(text)
    assert time.process_time() - start < 0.5
    if position is not None:
        assert caught.value.position == position
    assert len(str(caught.value)) < 400


def test_polynomial_pieces_and_range():
    # t² on [0, 1], then 1 + 2s + 3s² with s = t − 1.
    function = TimeFunction.polynomial(np.array([0.0, 1.0, 3.0]), np.array([[1.0, 0.0, 0.0], [3.0, 2.0, 1.0]]))
    assert function(0.5) == (0.25, 1.0, 2.0)
    assert function(1.0) == (1.0, 2.0, 6.0)
    assert function(3.0) == (17.0, 14.0, 6.0)
    assert function(3.0 + 1e-12)[0] == pytest.approx(17.0)  # a rounding beyond the end is still inside
    assert np.isnan(function(3.1)).all()
    assert np.isnan(function(-0.1)).all()


def write(path, text):
    path.write_text(text)
    return path


def test_waypoints_reproduce_a_quintic_at_rest_at_both_ends(tmp_path):
    # 10 t³ − 15 t⁴ + 6 t⁵ rests at both ends, so the quintic spline through any of its points is itself.
    times = np.concatenate([[0.0], np.sort(np.random.default_rng(1).uniform(0.0, 1.0, 9)), [1.0]])
    rows = "".join(f"{t!r},{t**3 * (10 - 15 * t + 6 * t * t)!r},2\n" for t in times.tolist())
    table = load_waypoints(write(tmp_path / "path.csv", "t,x,y\n" + rows))
    assert table.columns == ("x", "y")
    x, y = table.spline.functions()
    t = np.linspace(0, 1, 101)
    exact = [t**3 * (10 - 15 * t + 6 * t**2), 30 * t**2 * (1 - t) ** 2, 60 * t * (1 - t) * (1 - 2 * t)]
    np.testing.assert_allclose(x.sample(t), exact, atol=1e-9)
    np.testing.assert_allclose(y.sample(t), [2 + 0 * t, 0 * t, 0 * t], atol=1e-9)
    np.testing.assert_allclose([x(-0.5), x(1.5)], [[0, 0, 0], [1, 0, 0]], atol=1e-12)  # held before and after


def test_rows_that_repeat_are_a_hold(tmp_path):
    """Nothing overshoots: a move between two holds, and one that goes on through a row."""
    rows = "t,value\n0,0\n0.5,0\n1.5,1\n2,1\n2.5,0.6\n3,0.5\n4,0.5\n"
    (function,) = load_waypoints(write(tmp_path / "path.csv", rows)).spline.functions()
    value = function.sample(np.linspace(-1, 5, 6001))[0]
    assert value.min() > -1e-14
    assert value.max() == pytest.approx(1.0, abs=1e-14)
    for begin, end, height in ((0.0, 0.5, 0.0), (1.5, 2.0, 1.0), (3.0, 4.0, 0.5)):
        held = function.sample(np.linspace(begin, end, 11))
        np.testing.assert_allclose(held, np.array([height, 0, 0])[:, None] * np.ones(11), atol=1e-12)
    t = np.linspace(0.5, 1.5, 11)
    s = t - 0.5
    np.testing.assert_allclose(function.sample(t)[0], s**3 * (10 - 15 * s + 6 * s**2), atol=1e-12)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "header"),
        ("x,y\n0,0\n1,1\n", "header"),
        ("t,x,x\n0,0,0\n1,1,1\n", "line 1: expected each column once"),
        ("t,x\n0,0\n", "at least 2"),
        ("t,x\n0,0\n1,one\n", "line 3: expected 2 numbers"),
        ("t,x\n0,0\n1,nan\n", "line 3"),
        ("t,x\n0,0\n1,1,1\n", "line 3"),
        ("t,x\n0,0\n0,5,1,2\n", "line 3: expected 2 numbers .*decimal commas need semicolons"),
        ("t,x\n0,0\n1,1_0\n", "line 3: expected a number without underscores, found 1_0"),
        ("t,x\n0,0\n\n1,1\n1,2\n", "line 5: expected times that increase, found t = 1 after 1"),
    ],
)
def test_bad_waypoints_name_file_and_line(tmp_path, text, says):
    with pytest.raises(InputError, match=says) as caught:
        load_waypoints(write(tmp_path / "path.csv", text))
    assert "path.csv" in str(caught.value)
