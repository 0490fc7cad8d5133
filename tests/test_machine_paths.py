"""Paths as machines run them, solved: time scaling, shapers for the robot's frequencies, what is left of vibrations."""

import pytest
from tables_3d import pin, planar

import ffrobot
from ffrobot.common.errors import InputError
from ffrobot.run.fastest import least_stretch

ROTOR = {"mass": 2.0, "inertia": 0.3, "center": [0.0, 0.0], "points": {"root": [0.0, 0.0]}}


def arm(path, joint, end):
    path = {"name": "swing", "joint": "shoulder", "via": [0.0, 1.2], "fastest": True, **path}
    body, inverse = {"name": "arm", "rigid": ROTOR}, {"name": "inverse", "kind": "pcid", "end": end}
    shoulder = pin("shoulder", "ground", "arm.root", **joint)
    return ffrobot.make_scene(**planar([body], [shoulder], inverse | {"output_step": 1e-3}, trajectory=[path]))


def test_limits_of_the_path_hold_for_the_fastest_motion():
    """Motors that are strong enough leave the path as it is."""
    results = ffrobot.solve(arm({"speed": 1.0, "acceleration": 5.0}, {"moment_limit": 100.0}, end=3.0))
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
    with pytest.raises(InputError, match=says):
        ffrobot.solve(arm({"speed": 4.0, "acceleration": 40.0}, joint, end))


@pytest.mark.parametrize("limit", [0.013, 0.4, 1.0, 7.7])
def test_least_stretch_is_found_from_both_sides(limit):
    tried = []
    found = least_stretch(lambda stretch: tried.append(stretch) or stretch >= limit, 0.01, 10.0)
    assert limit <= found <= 1.005 * limit
    assert len(tried) < 22
