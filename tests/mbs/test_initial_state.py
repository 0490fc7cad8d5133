"""What is said when runs cannot start, and where guesses of ways place what slides."""

import numpy as np
import pytest
from links import TIP, arm, arm_links
from mechanisms import make_model, pcid, revolute
from oracle_runs import evaluated, run
from rods import rod

from ffrobot.common.errors import InputError, SolveError
from ffrobot.mbs.linear.statics import initial_state
from ffrobot.mbs.posture.start import undeformed_posture

HOLD = {"name": "tip", "point": "link2.tip", "x": repr(TIP[0]), "y": repr(TIP[1])}


def started(robot):
    state = undeformed_posture(robot.model)
    return evaluated(robot, 0.0, state.q, state.v)


FAR = [revolute("O", "ground", "link1.root"), revolute("A", "link1.tip", "link2.root"),
       revolute("far", "link2.tip", "ground", at=(2.5, 0.0))]  # fmt: skip


@pytest.mark.parametrize(
    ("made", "match"),
    [
        (lambda: make_model(arm_links(), joint=FAR, trajectory=[{"name": "a", "angle": "link1", "value": "0.3"}]),
         r'that meets .*"a" at t = 0, found none'),
        *((lambda at=at: arm(trajectory=[HOLD, {"name": "other", "point": "link2.tip"} | at]), r'"other"')
          for at in ({"x": repr(TIP[0])}, {"y": "0.1"})),
    ],
)  # fmt: skip
def test_loops_and_paths_that_cannot_be_met_are_named(made, match):
    with pytest.raises(InputError, match=match):
        run(made(), pcid())


def test_robot_without_equilibrium_is_refused():
    """A link that slides freely down a rail has none."""
    rail = {"name": "rail", "type": "prismatic", "between": ("ground", "link1.root"), "axis": (0.0, 1.0)}
    model = make_model(arm_links()[:1], joint=[rail], initial={"state": "static"})
    with pytest.raises(SolveError, match="no static equilibrium"):
        initial_state(model.model, undeformed_posture(model.model))


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
