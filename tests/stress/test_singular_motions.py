"""Stretched arms, dead centres, paths out of reach, constraints too many: who says so, when, and in what words."""

import numpy as np
import pytest
from links import arm_links
from mechanisms import make_model, revolute
from robots import free_run, inverse, parallelogram, reaching, slider_crank, through_dead_centre
from rods import rod

from ffrobot.common.errors import InputError

GROUP = "Singular configurations and redundant constraints"
SINGULAR = "reach only in a singular configuration"


def refused(run, *says):
    with pytest.raises(InputError) as raised:
        run()
    for text in says:
        assert text in str(raised.value)
    return str(raised.value)


def time_in(message):
    return float(message.split("t = ")[1].split(" s")[0])


@pytest.mark.parametrize("distance", [1e-2, 1e-4, 1e-6, 1e-8])
def test_passes_the_stretched_position(distance, record):
    path = f"(2-{distance})-0.5*(1-2*t)**2"
    outcomes = [inverse(reaching(path), tolerance=1e-5, integrator=name) for name in ("dop853", "radau")]
    for outcome in outcomes:
        outcome.check_completed()
        assert outcome.residual.max() < 1e-11
    largest = [np.abs(outcome.lambda_).max() for outcome in outcomes]
    assert largest[0] == pytest.approx(largest[1], rel=1e-3)
    record(GROUP, f"tip passes {distance:g} m before the arm is stretched", "forces up to {force} N", force=largest[0])


@pytest.mark.parametrize("beyond", [1e-4, 1e-2])
def test_path_leaves_the_workspace(beyond, record):
    """Between two of the times that are looked at, too."""
    path = f"(2+{beyond})-0.5*(1-2*(t-0.0025))**2"
    message = refused(lambda: inverse(reaching(path)), 'trajectory "tip": expected a target within reach')
    # the tip is at 2 m at 0.5025 − √(2 beyond)/2
    assert time_in(message) == pytest.approx(0.5025 - np.sqrt(2 * beyond) / 2, abs=0.012)
    record(
        GROUP,
        f"path of the tip leads {beyond:g} m out of reach",
        "rejected before the run",
        "input error: trajectory, time, “cannot reach” or “reach only in a singular configuration”",
    )


@pytest.mark.parametrize("flexible", [False, True])
@pytest.mark.parametrize("speed", [3.0, 3.01, 3.0007])
def test_slider_through_dead_centre(speed, flexible, record):
    """Exactly at one of the times that are looked at, and between them."""
    model = slider_crank(through_dead_centre(speed), flexible=flexible)
    message = refused(lambda: inverse(model), 'trajectory "slider"', SINGULAR, "drive a joint instead")
    assert time_in(message) == pytest.approx(0.9 / speed, abs=3e-6)
    record(
        GROUP,
        "slider-crank driven at the slider through a dead centre, rod rigid or flexible",
        "rejected before the run, its time to 3e-6 s",
        "input error: trajectory, time, “… (stretched, folded, at a dead centre) …”",
    )


@pytest.mark.parametrize("flexible", [False, True])
def test_crank_through_dead_centre(flexible, record):
    outcome = inverse(
        slider_crank({"name": "crank", "angle": "crank", "value": "0.9-3*t"}, flexible=flexible), tolerance=1e-6
    )
    outcome.check_completed()
    assert outcome.q[-1, 2] == pytest.approx(-2.1, abs=1e-9)
    record(GROUP, "slider-crank driven at the crank through a dead centre", "passes")


def test_free_through_dead_centres(record):
    outcome = free_run(slider_crank(None, rates={"crank": -10.0}), end=2.0, tolerance=1e-6)
    outcome.check_completed()
    assert np.abs(np.ptp(outcome.q[:, 2])) > 4 * np.pi
    record(GROUP, "slider-crank without a drive turns through dead centres", "passes")


def test_starts_at_dead_centre(record):
    path = {"name": "slider", "point": "slider.pin", "x": "0.7-0.1*t**2"}
    refused(lambda: inverse(slider_crank(path, angle=0.0)), "initial:", 'trajectory "slider"', "at a dead centre?")
    record(
        GROUP,
        "slider-crank starts at a dead centre, driven at the slider",
        "rejected",
        "input error: initial, trajectory",
    )


def test_parallelogram_turns_flat(record):
    path = {"name": "crank", "angle": "left", "value": "0.9-2*t"}
    message = refused(lambda: inverse(parallelogram(trajectory=[path])), 'trajectory "crank"', SINGULAR)
    assert time_in(message) == pytest.approx(0.45, abs=1e-6)
    record(
        GROUP,
        "flexible parallelogram driven through its flat position",
        "rejected before the run",
        "input error: trajectory, time, “reach only in a singular configuration”",
    )


def test_parallelogram_falls_flat(record):
    """Without a drive nothing can be looked at before: the run creeps, is stopped, and says what is the matter."""
    outcome = free_run(parallelogram(), end=3.0, tolerance=1e-4)
    assert outcome.status == "step underflow"
    assert "singular or nearly so" in outcome.statistics.cause
    assert outcome.statistics.steps < 20_000
    assert len(outcome.q) > 40
    record(
        GROUP,
        "flexible parallelogram falls into its flat position",
        "ends at t = {t} after {steps} steps",
        "step underflow; “the configuration is singular or nearly so (ratio of singular values 1e-06; …)”",
        t=outcome.statistics.time_reached,
        steps=outcome.statistics.steps,
    )


def test_third_crank_of_rods(record):
    refused(
        lambda: free_run(parallelogram(3, flexible=False)), "1 too many among", 'joint "mid foot"', "parallel cranks?"
    )
    record(
        GROUP,
        "parallelogram with a third crank, rigid links",
        "rejected",
        "input error: “1 too many among joint … in this geometry (parallel cranks?) …”",
    )


def test_third_crank_of_flexible_links(record):
    outcome = free_run(parallelogram(3), end=0.3, tolerance=1e-4)
    outcome.check_completed()
    assert outcome.residual.max() < 1e-11
    record(GROUP, "parallelogram with a third crank, flexible links", "modes share the force; passes")


def test_welded_twice(record):
    welds = [{"name": name, "type": "weld", "between": ("link1.tip", "link2.root")} for name in ("W", "again")]
    model = make_model(arm_links(), joint=[revolute("O", "ground", "link1.root"), *welds])
    refused(lambda: free_run(model), "3 too many among", 'joint "W"', 'joint "again"')
    record(GROUP, "two links welded twice", "rejected", 'input error: “3 too many among joint "W", x; …”')


def test_welded_at_both_ends(record):
    joints = [
        {"name": "root", "type": "weld", "between": ("ground", "beam.root")},
        {"name": "tip", "type": "weld", "between": ("ground", "beam.tip"), "at": (1.0, 0.0)},
    ]
    refused(lambda: free_run(make_model([rod("beam", 1.0, 1.0)], joint=joints)), "3 too many among")
    record(GROUP, "a rod welded to the ground at both ends", "rejected", "input error: “3 too many among …”")
