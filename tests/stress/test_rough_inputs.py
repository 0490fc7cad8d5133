"""Trajectories and loads that jump, kink or end, and numbers next to nothing."""

import numpy as np
import pytest
from links import arm
from mechanisms import make_model, revolute
from oracle_runs import run
from robots import free_run, inverse, pendulum, reaching
from rods import rod

from ffrobot.common.errors import InputError
from ffrobot.mbs.analysis.fcid import Fcid
from ffrobot.mbs.fields.functions import user_function
from ffrobot.mbs.run.drive import load_jump

ELBOW = (-0.2, 1.4)


def moved(x):
    return reaching(x, "0.9", ELBOW)


@pytest.mark.parametrize(
    ("x", "quantity"),
    [
        ("1.2+where(t > 0.50003, 0.1, 0)", "value"),
        ("1.2+where(t > 0.5, 1e-3, 0)", "value"),
        ("1.2+0.2*abs(t-0.50003)", "velocity"),
        ("1.2+1e-7*abs(t-0.5)", "velocity"),
        ("1.2-0.0001/(0.5005-t)", "value"),
    ],
)
@pytest.mark.parametrize("kind", ["pcid", "fcid"])
def test_jumps_are_refused(x, quantity, kind):
    found = inverse if kind == "pcid" else lambda model: run(model, zero_shape())
    with pytest.raises(
        InputError, match=f'trajectory "tip": x: expected a continuous {quantity}, found a jump'
    ) as raised:
        found(moved(x))
    assert float(str(raised.value).split("t = ")[1].split(" s")[0]) == pytest.approx(0.5, abs=6e-4)


def zero_shape():
    return Fcid(name="inverse", kind="fcid", shape="zero", end=1.0, output_step=0.01)


@pytest.mark.parametrize(
    ("moment", "says"),
    [("1/(0.5-t)", ""), ("sqrt(0.5-t)", 'load on "O", moment, has no finite value'), ("exp(exp(20*t))", "")],
)
def test_load_that_ends(moment, says):
    model = make_model(
        [rod("a", 1, 1)], joint=[revolute("O", "ground", "a.root")], load=[{"joint": "O", "moment": moment}]
    )
    outcome = free_run(model)
    assert outcome.status == "step underflow"
    assert says in outcome.statistics.cause
    assert outcome.statistics.time_reached <= 0.5
    assert 10 < len(outcome.q) == len(outcome.time) <= 51


@pytest.mark.parametrize(
    ("moment", "says"),
    [
        (lambda t: 80 * np.exp(-(((t - 0.50037) / 2e-3) ** 2)), ""),
        (lambda t: 3.0, ""),
        (lambda t: 1e4 * np.sin(20 * t), ""),
        (lambda t: 2.0 + (t > 0.5), "jumps from 2 to 3 there"),
        (lambda t: np.nan if t > 0.5 else 1.0, "has no finite value"),
    ],
)
def test_loads_from_python_are_blamed_for_their_values_alone(moment, says):
    """They need no slopes."""
    found = load_jump([('load on "O", moment,', user_function(moment))], 0.5)
    assert says in found
    assert bool(says) == bool(found)


@pytest.mark.parametrize("tiny", [5e-324, 1e-310, 1e-160])
def test_next_to_nothing(tiny):
    """Gravity, path and tolerances that are denormal numbers, or whose squares are."""
    quiet = free_run(pendulum(gravity=(0.0, -tiny)), end=0.1, tolerance=1e-6)
    path = {"name": "tip", "point": "link2.tip", "x": f"1.2+{tiny}*t**3", "y": "0.9"}
    held = inverse(
        arm(trajectory=[path], gravity=(0.0, -tiny), initial={"angles": {"link1": -0.2, "link2": 1.4}}), end=0.1
    )
    for outcome in (quiet, held):
        outcome.check_completed()
        assert np.isfinite(outcome.a).all()
        assert np.isfinite(outcome.lambda_).all()
        assert np.abs(outcome.v).max() <= 1e3 * tiny + 1e-11
