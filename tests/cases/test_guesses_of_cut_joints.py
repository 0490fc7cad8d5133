"""Guesses of the joint at which a loop is cut: all types of joints, and full turns."""

import numpy as np
import pytest
from tables_3d import revolute, rigid, scene

import ffrobot

TURN = 2 * np.pi
AXIS = {"axis": [0, 0, 1]}
CUT = {
    "revolute": (AXIS, 3 * TURN, [3 * TURN + 0.4]),
    "cylindrical": (AXIS, [-2 * TURN, 0.0], [-2 * TURN + 0.4, 0.0]),
    "planar": (AXIS, [0.0, 0.0, TURN], [0.0, 0.0, TURN + 0.4]),
    "universal": ({**AXIS, "second_axis": [1, 0, 0]}, [TURN, -TURN], [TURN + 0.4, -TURN]),
    "prismatic": ({"axis": [0, 0, 1], "rpy": [0.0, 0.0, 0.4]}, 0.1, [0.0]),
    "spherical": ({}, [0.1, 0.2, 0.3], None),
    "weld": ({"rpy": [0.0, 0.0, 0.4]}, None, None),
}


@pytest.mark.parametrize("kind", CUT)
def test_a_loop_is_cut_at_a_joint_with_a_guess(kind):
    """A bar turned by 0.4 rad on a pin of the ground, with a second joint beside the pin that closes a loop."""
    keys, guess, expected = CUT[kind]
    joints = [
        revolute("pin", "ground", "bar.root", motor=False),
        {"name": "other", "type": kind, "between": ["ground", "bar.root"], **keys},
    ]
    rest = {"name": "rest", "kind": "forward", "end": 0.02, "output_step": 0.01}
    start = {"joints": {"pin": 0.4} | ({} if guess is None else {"other": guess})}
    made = ffrobot.make_scene(**scene([rigid("bar")], joints, rest, initial=start))
    results = ffrobot.solve(made)
    assert results.has("rest/joints/other/coordinate") == (expected is not None)
    if expected is not None:
        found = results["rest/joints/other/coordinate"].reshape(3, -1)
        np.testing.assert_allclose(found, [expected] * 3, atol=1e-12)
