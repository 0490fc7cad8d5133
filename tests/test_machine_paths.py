"""Paths as machines run them, solved: time scaling, shapers for the robot's frequencies, what is left of vibrations."""

import pytest

import ffrobot
from ffrobot.common.errors import InputError
from ffrobot.run.fastest import least_stretch

INERTIA, TURN = 0.3, 1.2
RIGID = {"rigid": {"mass": 2.0, "inertia": INERTIA, "center": [0.0, 0.0], "points": {"root": [0.0, 0.0]}}}


def arm(body, path, joint=None, end=2.0):
    return ffrobot.make_scene(
        name="arm",
        gravity=[0.0, 0.0],
        body=[{"name": "arm", **body}],
        joint=[{"name": "shoulder", "type": "revolute", "between": ["ground", "arm.root"], **(joint or {})}],
        trajectory=[{"name": "swing", "joint": "shoulder", "via": [0.0, TURN], **path}],
        analysis=[{"name": "inverse", "kind": "pcid", "end": end, "output_step": 1e-3}],
    )


def test_limits_of_the_path_hold_for_the_fastest_motion():
    """Motors that are strong enough leave the path as it is."""
    path = {"speed": 1.0, "acceleration": 5.0, "fastest": True}
    results = ffrobot.solve(arm(RIGID, path, {"moment_limit": 100.0}, end=3.0))
    assert results.attributes("inverse/trajectories/swing")["stretch"] == 1.0


@pytest.mark.parametrize(
    ("joint", "end", "says"),
    [
        ({}, 2.0, "expected limits of motors"),
        ({"moment_limit": 0.05}, 2.0, 'end = 2 s of "inverse", found motor shoulder, with required/available ='),
        ({"moment_limit": 0.05}, 0.4, "expected a path that is over before"),
    ],
)
def test_what_cannot_be_made_faster_says_so(joint, end, says):
    path = {"speed": 4.0, "acceleration": 40.0, "fastest": True}
    with pytest.raises(InputError, match=says):
        ffrobot.solve(arm(RIGID, path, joint, end))


@pytest.mark.parametrize("limit", [0.013, 0.4, 1.0, 7.7])
def test_least_stretch_is_found_from_both_sides(limit):
    tried = []

    def keeps(stretch):
        tried.append(stretch)
        return stretch >= limit

    found = least_stretch(keeps, 0.01, 10.0)
    assert limit <= found <= 1.005 * limit
    assert len(tried) < 22
