"""Stretched arms, dead centres, paths out of reach, constraints too many: who says so, when, and in what words."""

import numpy as np
import pytest
from links import arm_links
from mechanisms import make_model, oracle_of, relative, revolute
from oracle_runs import joint_forces
from robots import free_run, inverse, parallelogram, reaching, slider_crank, through_dead_centre
from rods import rod

from ffrobot.common.errors import InputError

GROUP = "Singular configurations and redundant constraints"


def refused(run, *says):
    with pytest.raises(InputError) as raised:
        run()
    for text in says:
        assert text in str(raised.value)
    return str(raised.value)


def ends(run, *says):
    """A run that goes no further, and its time; its cause says why."""
    outcome = run()
    assert outcome.status == "step underflow"
    for text in says:
        assert text in outcome.statistics.cause
    return outcome.statistics.time_reached


def off_rows(outcome):
    """The largest of C and Ċ of all joints and paths by the oracle, relative to their terms."""
    mechanism, worst = oracle_of(outcome.assembly), 0.0
    for t, q, v in zip(outcome.time, outcome.q, outcome.v, strict=True):
        C, C_dot, C_q = mechanism.constraint_values(t, q, v)
        worst = max(worst, *np.abs(C), *(np.abs(C_dot) / (1.0 + np.abs(C_q) @ np.abs(v))))
    return worst


def time_in(message):
    return float(message.split("t = ")[1].split(" s")[0])


@pytest.mark.parametrize("distance", [1e-2, 1e-4, 1e-6, 1e-8])
def test_passes_the_stretched_position(distance, record):
    path = f"(2-{distance})-0.5*(1-2*t)**2"
    outcomes = [inverse(reaching(path), tolerance=1e-5, integrator=name) for name in ("dop853", "radau")]
    for outcome in outcomes:
        outcome.check_completed()
        assert outcome.motion.violation.max() < 1e-11  # to which states are projected, of 1 + the largest rate
        assert off_rows(outcome) < 1e-10  # rates of the tip are smaller than those of the joints here
    largest = [np.abs(outcome.lambda_).max() for outcome in outcomes]
    assert largest[0] == pytest.approx(largest[1], rel=1e-3)
    record(GROUP, f"tip passes {distance:g} m before the arm is stretched", "forces up to {force} N", force=largest[0])


@pytest.mark.parametrize("beyond", [1e-4, 1e-2])
def test_path_leaves_the_workspace(beyond, record):
    """Between two of the times that are looked at, too."""
    path = f"(2+{beyond})-0.5*(1-2*(t-0.0025))**2"
    message = refused(
        lambda: inverse(reaching(path)),
        'trajectory "tip": expected a target within reach',
        "from which the links reach 2 m",
    )
    # the tip is at 2 m at 0.5025 − √(2 beyond)/2
    assert time_in(message) == pytest.approx(0.5025 - np.sqrt(2 * beyond) / 2, abs=0.012)
    record(
        GROUP,
        f"path of the tip leads {beyond:g} m out of reach",
        "rejected before the run",
        "input error: trajectory, its distance, time, the reach of the links",
    )


@pytest.mark.parametrize("flexible", [False, True])
@pytest.mark.parametrize("speed", [3.0, 3.01, 3.0007])
def test_slider_through_dead_centre(speed, flexible, record):
    """Exactly at an output, and between them."""
    model = slider_crank(through_dead_centre(speed), flexible=flexible)
    t = ends(lambda: inverse(model), "singular or nearly so", 'trajectory "slider"', "drive a joint instead")
    assert t == pytest.approx(0.9 / speed, abs=3e-6)
    record(
        GROUP,
        "slider-crank driven at the slider through a dead centre, rod rigid or flexible",
        "ends there, within 3e-6 s",
        "step underflow; trajectory, “singular or nearly so … at a dead center …”",
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
    refused(lambda: inverse(slider_crank(path, angle=0.0)), "initial:", 'trajectory "slider"', "found a singular one")
    record(
        GROUP,
        "slider-crank starts at a dead centre, driven at the slider",
        "rejected",
        "input error: initial, trajectory",
    )


def test_parallelogram_turns_flat(record):
    path = {"name": "crank", "angle": "left", "value": "0.9-2*t"}
    t = ends(lambda: inverse(parallelogram(trajectory=[path])), 'loops that "right head" close', "drive a joint")
    assert t == pytest.approx(0.45, abs=1e-4)
    record(
        GROUP,
        "flexible parallelogram driven through its flat position",
        "ends there, within 1e-4 s",
        "step underflow; loops, “singular or nearly so … cranks and coupler in a line …”",
    )


def test_parallelogram_falls_flat(record):
    """Without a drive nothing can be looked at before: the run creeps, is stopped, and says what is the matter."""
    outcome = free_run(parallelogram(), end=3.0, tolerance=1e-4)
    assert outcome.status == "step underflow"
    assert "is singular or nearly so" in outcome.statistics.cause
    assert outcome.statistics.steps < 20_000
    assert len(outcome.q) > 40
    record(
        GROUP,
        "flexible parallelogram falls into its flat position",
        "ends at t = {t} after {steps} steps",
        "step underflow; loops, “singular or nearly so … cranks and coupler in a line …”",
        t=outcome.statistics.time_reached,
        steps=outcome.statistics.steps,
    )


def test_third_crank_of_rods(record):
    outcome = free_run(parallelogram(3, flexible=False), end=0.3)
    outcome.check_completed()
    assert off_rows(outcome) < 1e-11
    alike = free_run(parallelogram(2, flexible=False), end=0.3)
    assert np.abs(outcome.q[:, 2] - alike.q[:, 2]).max() > 1e-3  # the third one is heavy, too
    record(GROUP, "parallelogram with a third crank, rigid links", "constraints that repeat others are shared; passes")


def test_third_crank_of_flexible_links(record):
    outcome = free_run(parallelogram(3), end=0.3, tolerance=1e-4)
    outcome.check_completed()
    assert off_rows(outcome) < 1e-11
    record(GROUP, "parallelogram with a third crank, flexible links", "modes share the force; passes")


def test_welded_twice(record):
    hinge = revolute("O", "ground", "link1.root")
    welds = [{"name": name, "type": "weld", "between": ("link1.tip", "link2.root")} for name in ("W", "again")]
    one, twice = (
        free_run(make_model(arm_links(), joint=[hinge, *some]), end=0.1, tolerance=1e-8) for some in (welds[:1], welds)
    )
    twice.check_completed()
    assert relative(twice.q, one.q) < 1e-6
    record(GROUP, "two links welded twice", "moves as welded once")


def test_welded_at_both_ends(record):
    joints = [
        {"name": "root", "type": "weld", "between": ("ground", "beam.root")},
        {"name": "tip", "type": "weld", "between": ("ground", "beam.tip"), "at": (1.0, 0.0)},
    ]
    outcome = free_run(make_model([rod("beam", 1.0, 1.0)], joint=joints), end=0.1)
    outcome.check_completed()
    reactions = sum(joint_forces(outcome, name).reaction for name in ("root", "tip"))
    np.testing.assert_allclose(reactions, [[0.0, 9.81]] * len(outcome.time), atol=1e-9)
    record(GROUP, "a rod welded to the ground at both ends", "stays; the welds carry its weight together")
