"""Functions of Python and compiled ones in place of expressions."""

import gc
import math
import weakref
from types import SimpleNamespace

import numpy as np
import pytest
from tables_3d import pin, planar

import ffrobot
from ffrobot.mbs.fields.expressions import parse_expression
from ffrobot.mbs.fields.functions import check_derivatives, state_function, user_function

SINE = "void sine(double t, double *out) { out[0] = 0.5 * sin(t); out[1] = 0.5 * cos(t); out[2] = -out[0]; }"


def sine(t):
    return 0.5 * math.sin(t), 0.5 * math.cos(t), -0.5 * math.sin(t)


def swing(value="0.5*sin(t)", load="0"):
    rod = {"mass": 1.0, "inertia": 0.1, "center": [0.3, 0.0], "points": {"root": [0, 0], "tip": [0.6, 0]}}
    inverse = {"name": "inverse", "kind": "pcid", "end": 0.1, "output_step": 0.01}
    keys = {"trajectory": [{"name": "turn", "joint": "shoulder", "value": value}]}
    keys["load"] = [{"point": "arm.tip", "y": load}]
    shoulder = pin("shoulder", "ground", "arm.root")
    return ffrobot.make_scene(**planar([{"name": "arm", "rigid": rod}], [shoulder], inverse, **keys))


def moment(scene):
    return ffrobot.solve(scene)["inverse/joints/shoulder/moment"]


def test_functions_are_as_good_as_expressions(compiled):
    expected = moment(swing())
    np.testing.assert_allclose(moment(swing(sine)), expected, rtol=1e-12)
    np.testing.assert_allclose(moment(swing(compiled("sine", SINE))), expected, rtol=1e-12)


@pytest.mark.parametrize("made_of", [user_function, state_function])
def test_compiled_functions_outlive_their_names(made_of):
    """Where they are made inside a function of the user, machine code may go with the object that has the address."""
    function = type("Compiled", (), {"address": 4096})()  # nothing calls it
    known = weakref.ref(function)
    made_of(function)
    del function
    gc.collect()
    assert known() is not None


def test_load_needs_the_value_alone():
    np.testing.assert_allclose(moment(swing(load=lambda t: 3.0 * t)), moment(swing(load="3*t")), rtol=1e-12)


def test_text_of_the_scene_names_the_function():
    assert 'value = "<sine, function no. 1, content ' in swing(sine).text


@pytest.mark.parametrize(
    ("value", "complaint"),
    [
        (lambda t: 0.5 * t, "expected a function of t that returns (value, rate, acceleration)"),
        (lambda t: {}, "expected numbers, found {} at t = 0 s"),
        (lambda t: (0.0, 1.0), "expected (value, rate, acceleration)"),
        (SimpleNamespace(address="here"), "expected a function of t"),
    ],
)
def test_functions_that_are_none_of_a_path(value, complaint):
    with pytest.raises(ffrobot.InputError) as error:
        swing(value)
    assert complaint in str(error.value)


def cosine(t):
    return 0.5 * math.cos(9 * t), -4.5 * math.sin(9 * t), -40.5 * math.cos(9 * t)


def jumping(t):
    """Its acceleration jumps at t = 0.0371."""
    s = max(0.0, t - 0.0371)
    return 0.3 + 5 * s**2, 10 * s, 10.0 * (s > 0)


HONEST = {
    "sine": sine,
    "constant": lambda t: (0.3, 0.0, 0.0),
    "large and slow": lambda t: (1e3 + 1e-4 * t**2, 2e-4 * t, 2e-4),
    "acceleration jumps": jumping,
    "rounded to single precision": lambda t: tuple(float(np.float32(x)) for x in cosine(t)),
    "vibrates fast": lambda t: (math.sin(3e4 * t), 3e4 * math.cos(3e4 * t), -9e8 * math.sin(3e4 * t)),
    "zero and then not": lambda t: (0.0, 0.0, 0.0) if t < 0.05 else ((t - 0.05) ** 3, 3 * (t - 0.05) ** 2, 6 * t - 0.3),
}
WRONG = {
    "no rate": (lambda t: (cosine(t)[0], 0.0, 0.0), "rate"),
    "no acceleration": (lambda t: (*cosine(t)[:2], 0.0), "acceleration"),
    "sign of the acceleration": (lambda t: (*cosine(t)[:2], -cosine(t)[2]), "acceleration"),
    "rate in degrees": (lambda t: (cosine(t)[0], math.degrees(cosine(t)[1]), cosine(t)[2]), "rate"),
    "inner derivative forgotten": (lambda t: (cosine(t)[0], cosine(t)[1] / 9, cosine(t)[2]), "rate"),
    "off by a per cent": (lambda t: (cosine(t)[0], 1.01 * cosine(t)[1], cosine(t)[2]), "rate"),
    "wrong after a jump only": (lambda t: (jumping(t)[0], jumping(t)[1], 0.0), "acceleration"),
}


@pytest.mark.parametrize("function", HONEST.values(), ids=HONEST)
@pytest.mark.parametrize("end", [0.1, 1.0, 7.3])
def test_honest_derivatives_are_taken(function, end):
    check_derivatives(user_function(function), end, "path")


@pytest.mark.parametrize("value", ["pi/2+1.5*t**4", "100+1.5*t**4", "pi/2+0.1*t**5", "1e3+sin(t)**4"])
@pytest.mark.parametrize("end", [2e-5, 2e-3, 1e-2, 5e-2])
def test_small_changes_of_large_values_are_round_off(value, end):
    """Differences cannot see them: eps |value| / step is more than the rate."""
    check_derivatives(parse_expression(value), end, "path")


@pytest.mark.parametrize(("function", "said"), WRONG.values(), ids=WRONG)
@pytest.mark.parametrize("end", [0.1, 1.0])
def test_wrong_derivatives_are_found(function, said, end):
    difference = {"rate": "value", "acceleration": "rate"}[said]
    complaint = rf"found the {said} \S+ at t = \S+ s, where differences of the {difference} are"
    with pytest.raises(ffrobot.InputError, match=complaint):
        check_derivatives(user_function(function), end, "path")


def test_wrong_derivatives_of_a_compiled_function(compiled):
    """What it leaves as it is, is zero."""
    with pytest.raises(ffrobot.InputError, match='trajectory "turn": value: expected the derivatives of the value'):
        swing(compiled("part", "void part(double t, double *out) { out[0] = t * t; }"))
