"""Runs in joint coordinates give what those in absolute ones do; which run in what is decided before the first step."""

import numpy as np
import pytest
import zoo
from links import arm
from mechanisms import always, forward, pcid, relative

from ffrobot.mbs.analysis import drive
from ffrobot.mbs.analysis.forward import run_forward
from ffrobot.mbs.analysis.outcome import EarlierRun
from ffrobot.mbs.analysis.pcid import run_pcid
from ffrobot.mbs.analysis.replay import ActuatorSet
from ffrobot.mbs.analysis.tree_start import LOOPS, OTHERS

KEYS = {"end": 0.05, "output_step": 0.005, "tolerance": 1e-10, "integrator": "dop853"}
DRIVEN = (
    "chain of 2",
    "backwards",
    "mixed",
    "mixed backwards",
    "tree",
    "loaded",
    "mixed, as built",
)


@pytest.fixture
def in_absolute(monkeypatch):
    """Makes runs stay in absolute coordinates."""

    def stay():
        monkeypatch.setattr(drive, "tree_start", lambda *_: "asked for")

    return stay


def compare(found, expected, share):
    assert found.statistics.coordinates == "joint"
    assert expected.statistics.coordinates == "absolute: asked for"
    for name in ("q", "v", "a", "lambda_", "tau", "F_p"):
        if (numbers := getattr(expected, name)) is not None and numbers.size:
            peak = max(np.abs(numbers).max(), 1e-6)  # nothing but rounding in joints of what falls freely
            assert relative(getattr(found, name), numbers, peak) < share, name
    assert found.residual.max() < 1e-9


@pytest.mark.parametrize("name", DRIVEN)
def test_inverse_dynamics(name, in_absolute):
    model = zoo.build(name)
    found = run_pcid(model, pcid(**KEYS), False, always)
    in_absolute()
    compare(found, run_pcid(model, pcid(**KEYS), False, always), 1e-7)


@pytest.mark.parametrize("name", [*DRIVEN, "free-flying", "loaded, frame motors"])
def test_free_motion(name, in_absolute):
    model = zoo.build(name)
    found = run_forward(model, forward(**KEYS), None, ActuatorSet(), always)
    in_absolute()
    compare(found, run_forward(model, forward(**KEYS), None, ActuatorSet(), always), 1e-7)


@pytest.mark.parametrize("apply", ["joints", "trajectory"])
def test_replay(apply, in_absolute):
    """Steps recorded in joint coordinates are made again in absolute ones, and act on the tree."""
    model = arm()
    source = run_pcid(model, pcid(**KEYS), True, always)
    replay = forward(**KEYS, actuation="inverse", apply=apply)
    found = run_forward(model, replay, source, ActuatorSet(), always)
    assert source.statistics.coordinates == found.statistics.coordinates == "joint"
    in_absolute()
    expected = run_forward(model, replay, source, ActuatorSet(), always)
    compare(found, expected, 1e-7)
    if apply == "trajectory":
        assert relative(found.q, source.q) < 1e-6


@pytest.mark.parametrize("integrator", OTHERS)
def test_implicit_methods_stay_in_absolute_coordinates(integrator):
    outcome = run_pcid(arm(), pcid(end=0.01, tolerance=1e-3, integrator=integrator), False, always)
    assert outcome.statistics.coordinates == f"absolute: {OTHERS[integrator]}"


@pytest.mark.parametrize("name", ["chain of 2", "mixed backwards", "loaded", "mixed, as built"])
def test_dopri5(name, in_absolute):
    """Within what the tolerance leaves to both."""
    model, keys = zoo.build(name), KEYS | {"integrator": "dopri5", "tolerance": 1e-8}
    found = run_pcid(model, pcid(**keys), False, always)
    in_absolute()
    compare(found, run_pcid(model, pcid(**keys), False, always), 2e-8)


@pytest.mark.parametrize(("name", "why"), [("stiffened", "geometric stiffening"), ("four-bar", LOOPS)])
def test_other_mechanisms_stay_in_absolute_coordinates(name, why):
    outcome = run_forward(zoo.build(name), forward(**KEYS), None, ActuatorSet(), always)
    assert outcome.statistics.coordinates == f"absolute: {why}"


@pytest.mark.parametrize("stopped_in", ["joint", "absolute"])
def test_runs_go_on_in_the_coordinates_in_which_they_were_stopped(stopped_in, in_absolute, monkeypatch):
    """To the last bit."""
    model, analysis = arm(), pcid(**KEYS)
    with monkeypatch.context() as patch:
        if stopped_in == "absolute":
            patch.setattr(drive, "tree_start", lambda *_: "asked for")
        whole = run_pcid(model, analysis, True, always)
        stopped = run_pcid(model, analysis.model_copy(update={"max_steps": whole.statistics.steps // 2}), True, always)
    assert stopped.status == "too many steps"
    earlier = EarlierRun(stopped.motion, stopped.forces, stopped.statistics, stopped.continuation, "run")
    again = run_pcid(model, analysis, True, always, earlier)
    assert again.statistics.coordinates.partition(":")[0] == stopped_in
    for name in ("q", "v", "a", "lambda_", "tau"):
        assert np.array_equal(getattr(again, name), getattr(whole, name)), name
    assert np.array_equal(again.continuation.recording.states, whole.continuation.recording.states)
