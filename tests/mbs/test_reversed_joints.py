"""A scene in 3D does not depend on which side of a joint comes first in `between`."""

import numpy as np
from beam_links import beam_link, tube

import ffrobot

LINK = beam_link(0.5, tube(0.02, 0.016), 10, name="rod", modes={"count": 4}, damping={"ratio": 0.01})  # fmt: skip
BOX = {"mass": 0.4, "center": [0.05, 0.01, 0.0], "inertia": [2e-4, 4e-4, 3e-4],
       "points": {"rim": [0.0, 0.0, 0.02], "tip": [0.1, 0.0, 0.0]}}  # fmt: skip


SMOOTH = "10*t**3 - 15*t**4 + 6*t**5"


def scene(joints):
    """A flexible rod on the ground, a box on it; every joint follows a path of its own."""
    return ffrobot.make_scene(
        name="arm", space="spatial", gravity=[0.0, 0.0, -9.81],
        body=[{"name": "rod", "link": LINK}, {"name": "box", "rigid": BOX}],
        joint=joints,
        trajectory=[{"name": "turn", "joint": "pin", "value": f"0.3 + {SMOOTH}"},
                    {"name": "slide", "joint": "guide", "value": f"0.05 + 0.1*({SMOOTH})"}],
        analysis=[{"name": "a", "kind": "pcid", "end": 0.4, "output_step": 0.05, "tolerance": 1e-8}],
    )  # fmt: skip


AHEAD = [
    {"name": "pin", "type": "revolute", "between": ["ground", "rod.root"], "axis": [0.0, 0.0, 1.0]},
    {"name": "guide", "type": "prismatic", "between": ["rod.tip", "box.rim"], "axis": [0.0, 1.0, 0.0]},
]
# The same motion: seen from the second side, the first one moves the other way; coordinates count that.
BACK = [joint | {"between": joint["between"][::-1], "axis": [-x for x in joint["axis"]]} for joint in AHEAD]


def test_paths_of_joints():
    """Coordinates, moments, forces on paths and the deflection, whichever way round: to the tolerance."""
    with ffrobot.solve(scene(AHEAD)) as first, ffrobot.solve(scene(BACK)) as second:
        t = first["a/time"]
        np.testing.assert_allclose(second["a/joints/pin/coordinate"], 0.3 + 10 * t**3 - 15 * t**4 + 6 * t**5, atol=1e-6)
        for key in ("joints/pin/coordinate", "joints/pin/moment", "joints/guide/coordinate", "joints/guide/moment",
                    "trajectories/turn/force", "trajectories/slide/force", "points/rod.tip/position",
                    "points/rod.tip/deflection"):  # fmt: skip
            a, b = first[f"a/{key}"], second[f"a/{key}"]
            np.testing.assert_allclose(b, a, atol=1e-6 * np.abs(a).max(), err_msg=key)
