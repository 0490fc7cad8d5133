"""Where runs start, and what is said when they cannot."""

import numpy as np
import pytest
from links import ANGLES, TIP, arm, arm_links
from mechanisms import make_model, pcid, revolute
from oracle_runs import evaluated, run
from rods import rod, slider_crank

from ffrobot.common.errors import InputError, SolveError
from ffrobot.mbs.linear.statics import initial_state
from ffrobot.mbs.posture.start import undeformed_posture
from ffrobot.mbs.quantities.motion import section_motion

HOLD = {"name": "tip", "point": "link2.tip", "x": repr(TIP[0]), "y": repr(TIP[1])}


def refused(model, match):
    with pytest.raises(InputError, match=match):
        run(model, pcid())


def to(x, y, name="tip"):
    return {"name": name, "point": "link2.tip", "x": x, "y": y}


def started(robot):
    state = undeformed_posture(robot.model)
    return evaluated(robot, 0.0, state.q, state.v)


def angle(found, body):
    return found.q[0, found.coordinates(body)][2]


def test_start_meets_constraints_and_rates_undeformed():
    found = started(arm(trajectory=[to("1.2-0.3*t", "0.9+0.5*t")]))
    tip = section_motion(found.motion, "link2.tip")
    np.testing.assert_allclose(tip.r[0, :2], [1.2, 0.9], atol=1e-13)
    np.testing.assert_allclose(tip.velocity[0, :2], [-0.3, 0.5], atol=1e-13)
    for name in ANGLES:
        assert not np.any(found.q[0, found.coordinates(name)][3:])
        assert not np.any(found.v[0, found.coordinates(name)][3:])


@pytest.mark.parametrize(("angles", "elbow"), [({"link1": -0.2, "link2": 1.4}, 1), ({"link1": 1.4, "link2": -0.2}, -1)])
def test_the_guess_picks_the_elbow(angles, elbow):
    found = started(arm(trajectory=[to("1.2", "0.9")], initial={"angles": angles}))
    turn = angle(found, "link2") - angle(found, "link1")
    assert turn == pytest.approx(elbow * 2 * np.arccos(0.75), abs=1e-12)  # law of cosines: 1.5 = 2 cos(turn/2)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_closed_loop_takes_the_branch_of_the_guess(side):
    """The crank above or below the axis, same slider position."""
    path = {"name": "slider", "point": "slider.pin", "x": "0.6"}
    found = started(slider_crank(path, initial={"angles": {"crank": 0.9 * side, "rod": -0.3 * side}}))
    # 0.5² = 0.2² + 0.6² − 2 · 0.2 · 0.6 cos φ
    expected = side * np.arccos((0.04 + 0.36 - 0.25) / 0.24)
    assert angle(found, "crank") == pytest.approx(expected, abs=1e-12)


def test_stretched_arm_is_refused():
    model = arm(trajectory=[to("2", "0")], initial={"angles": {"link1": 0.0, "link2": 0.0}})
    refused(model, r'the links can follow trajectory "tip" in every direction, found a singular one.*stretched')


def test_loop_that_cannot_be_closed_is_named():
    joints = [
        revolute("O", "ground", "link1.root"),
        revolute("A", "link1.tip", "link2.root"),
        revolute("far", "link2.tip", "ground", at=(2.5, 0.0)),
    ]
    refused(
        make_model(arm_links(), joint=joints, trajectory=[{"name": "a", "angle": "link1", "value": "0.3"}]),
        r'that meets .*"a" at t = 0, found none',
    )


@pytest.mark.parametrize("component", [{"x": repr(TIP[0])}, {"y": "0.1"}])
def test_repeated_and_contradicting_trajectories_are_named(component):
    other = {"name": "other", "point": "link2.tip", **component}
    refused(arm(trajectory=[HOLD, other]), r'"other"')


def test_static_start_is_at_rest():
    """A robot held still under gravity: no accelerations, no ringing later on."""
    model = arm(trajectory=[HOLD], initial={"angles": ANGLES, "state": "static"})
    outcome = run(model, pcid(tolerance=1e-8))
    assert np.abs(outcome.q[0][3:6]).max() > 1e-4  # it sags
    assert np.abs(outcome.a[0]).max() < 1e-8
    assert np.abs(outcome.q - outcome.q[0]).max() < 1e-10
    assert np.abs(outcome.lambda_ - outcome.lambda_[0]).max() < 1e-8 * np.abs(outcome.lambda_).max()


def test_robot_without_equilibrium_is_refused():
    """A link that slides freely down a rail has none."""
    rail = {"name": "rail", "type": "prismatic", "between": ("ground", "link1.root"), "axis": (0.0, 1.0)}
    model = make_model(arm_links()[:1], joint=[rail], initial={"state": "static"})
    with pytest.raises(SolveError, match="no static equilibrium"):
        initial_state(model.model)


def test_a_guess_of_a_way_places_what_slides():
    """Along the axis of a rod that turns, forwards and backwards named; bodies that joints leave out follow on."""
    rods = [rod("arm", 1.0, 1.0), rod("slide", 0.5, 1.5)]
    for between, way in ((("arm.tip", "slide.root"), 0.3), (("slide.root", "arm.tip"), -0.3)):
        joints = [
            revolute("O", "ground", "arm.root"),
            {"name": "S", "type": "prismatic", "between": between, "axis": (1.0, 0.0)},
        ]
        initial = {"joints": {"O": 0.5, "S": way}, "joint_rates": {"O": 2.0, "S": way / 0.3}}
        found = started(make_model(rods, joint=joints, initial=initial))
        along, across = np.array([np.cos(0.5), np.sin(0.5)]), np.array([-np.sin(0.5), np.cos(0.5)])
        np.testing.assert_allclose(found.q[0, 3:], [*(1.3 * along), 0.5], atol=1e-12)
        np.testing.assert_allclose(found.v[0, 3:], [*(along + 2.6 * across), 2.0], atol=1e-12)
