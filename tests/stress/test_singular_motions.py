"""Stretched arms, dead centres, paths out of reach, constraints too many: who says so, when, and in what words."""

import numpy as np
import pytest
from mechanisms import make_model
from oracle_runs import joint_forces
from robots import free_run, inverse, reaching, slider_crank, through_dead_centre
from rods import rod
from tree_oracle import target_rates

from ffrobot.common.errors import InputError
from ffrobot.mbs.quantities.motion import constraint_rows, constraint_violation


def ends(run, *says):
    """A run that goes no further, and its time; its cause says why."""
    outcome = run()
    assert outcome.status == "step underflow"
    for text in says:
        assert text in outcome.statistics.cause
    return outcome.statistics.time_reached


def off_rows(outcome):
    """The largest of C and Ċ of loops and paths, relative to their terms."""
    motion, v = outcome.motion, np.abs(outcome.outcome.v)
    C, C_v = constraint_rows(motion)
    C_dot = np.einsum("tij,tj->ti", C_v, motion.v) - target_rates(motion.model, motion.q, motion.time)
    return max(np.abs(C).max(), (np.abs(C_dot) / (1.0 + np.einsum("tij,tj->ti", np.abs(C_v), v))).max())


@pytest.mark.parametrize("distance", [1e-2, 1e-4, 1e-6, 1e-8])
def test_passes_the_stretched_position(distance):
    path = f"(2-{distance})-0.5*(1-2*t)**2"
    outcomes = [inverse(reaching(path), tolerance=1e-5, integrator=name) for name in ("dop853", "radau")]
    for outcome in outcomes:
        outcome.check_completed()
        assert (
            constraint_violation(outcome.motion).max() < 1e-11
        )  # to which states are projected, of 1 + the largest rate
        assert off_rows(outcome) < 1e-10  # rates of the tip are smaller than those of the joints here
    largest = [np.abs(outcome.lambda_).max() for outcome in outcomes]
    assert largest[0] == pytest.approx(largest[1], rel=1e-3)


@pytest.mark.parametrize("flexible", [False, True])
@pytest.mark.parametrize("speed", [3.0, 3.01, 3.0007])
def test_slider_through_dead_centre(speed, flexible):
    """Exactly at an output, and between them."""
    model = slider_crank(through_dead_centre(speed), flexible=flexible)
    t = ends(lambda: inverse(model), "singular or nearly so", 'trajectory "slider"', "drive a joint instead")
    assert t == pytest.approx(0.9 / speed, abs=3e-6)


@pytest.mark.parametrize("flexible", [False, True])
def test_crank_through_dead_centre(flexible):
    outcome = inverse(
        slider_crank({"name": "crank", "angle": "crank", "value": "0.9-3*t"}, flexible=flexible), tolerance=1e-6
    )
    outcome.check_completed()
    assert outcome.q[-1, 2] == pytest.approx(-2.1, abs=1e-9)


def test_free_through_dead_centres():
    outcome = free_run(slider_crank(None, rates={"crank": -10.0}), end=2.0, tolerance=1e-6)
    outcome.check_completed()
    assert np.abs(np.ptp(outcome.q[:, 2])) > 4 * np.pi


def test_starts_at_dead_centre():
    path = {"name": "slider", "point": "slider.pin", "x": "0.7-0.1*t**2"}
    with pytest.raises(InputError) as raised:
        inverse(slider_crank(path, angle=0.0))
    for text in ("initial:", 'trajectory "slider"', "found a singular one"):
        assert text in str(raised.value)


def test_welded_at_both_ends():
    joints = [
        {"name": "root", "type": "weld", "between": ("ground", "beam.root")},
        {"name": "tip", "type": "weld", "between": ("ground", "beam.tip"), "at": (1.0, 0.0)},
    ]
    outcome = free_run(make_model([rod("beam", 1.0, 1.0)], joint=joints), end=0.1)
    outcome.check_completed()
    reactions = sum(joint_forces(outcome, name).reaction for name in ("root", "tip"))
    np.testing.assert_allclose(reactions, [[0.0, 9.81]] * len(outcome.time), atol=1e-9)
