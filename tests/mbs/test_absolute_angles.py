"""Trajectories of one component of orientation in 3D: an absolute angle about an axis, the others free."""

import numpy as np
import pytest

import ffrobot
from ffrobot.common.rotations import smallest_turn

HAND = {"mass": 1.3, "center": [0.2, 0.03, -0.02], "inertia": [0.012, 0.03, 0.04],
        "points": {"root": [0.0, 0.0, 0.0], "tip": [0.4, 0.0, 0.0]}}  # fmt: skip
WRIST = {"mass": 0.4, "center": [0.01, 0.0, 0.05], "inertia": [2e-3, 2e-3, 1e-3],
         "points": {"root": [0.0, 0.0, 0.0], "top": [0.0, 0.0, 0.1]}}  # fmt: skip
TURN, TILT = "0.4 + 2*sin(3*t)", "0.6*cos(2*t) - 0.2"


def yaw_and_pitch(axis, path, hand=HAND, **more):
    """A wrist that turns about `axis`, and a hand that tilts on it about an axis across: headings are the yaw."""
    across = smallest_turn(np.array(axis))[:, 1].tolist()
    joint = {"type": "revolute"}
    return ffrobot.make_scene(
        name="pan and tilt", space="spatial", gravity=[0.5, -1.0, -9.0],
        body=[{"name": "wrist", "rigid": WRIST}, {"name": "hand"} | hand],
        joint=[joint | {"name": "pan", "between": ["ground", "wrist.root"], "axis": axis},
               joint | {"name": "tilt", "between": ["wrist.top", "hand.root"], "axis": across}],
        trajectory=[{"name": "heading"} | path, {"name": "tilting", "joint": "tilt", "value": TILT}],
        initial={"joints": {"pan": 0.3, "tilt": 0.4}}, **more,
    )  # fmt: skip


INVERSE = {"name": "inverse", "kind": "pcid", "end": 1.0, "output_step": 0.05, "tolerance": 1e-10}


@pytest.mark.parametrize("axis", [[0.0, 0.0, 1.0], [1.0, 2.0, 2.0], [0.3, -0.2, -1.0]])
@pytest.mark.parametrize("kind", [{}, {"kind": "fcid", "shape": "zero"}], ids=["pcid", "fcid"])
def test_the_heading_of_a_tilted_hand_is_its_pan(axis, kind):
    """The hand's direction R_n(ψ) R_m(θ) e with m = n × e has the heading ψ about n, however far it is tilted by θ."""
    analysis = [INVERSE | kind]
    found = ffrobot.solve(
        yaw_and_pitch(axis, {"angle": "hand.tip", "axis": axis, "value": TURN}, {"rigid": HAND}, analysis=analysis)
    )
    of_joint = ffrobot.solve(yaw_and_pitch(axis, {"joint": "pan", "value": TURN}, {"rigid": HAND}, analysis=analysis))
    for name in ("pan", "tilt"):
        for key in ("coordinate", "rate", "moment"):
            expected = of_joint[f"inverse/joints/{name}/{key}"]
            actual = found[f"inverse/joints/{name}/{key}"]
            np.testing.assert_allclose(actual, expected, rtol=0, atol=1e-8 * (1 + np.abs(expected).max()))
    t = np.array(found["inverse/time"])
    np.testing.assert_allclose(found["inverse/trajectories/heading/target"][:, 0], 0.4 + 2 * np.sin(3 * t), atol=1e-12)
    assert np.max(found["inverse/constraint_violation"]) < 1e-9


def test_turns_beyond_a_full_one():
    """From rest to rest by three turns against the axis of the joint, out of the plane."""
    path = {"angle": "hand.tip", "axis": [0.0, 0.0, -1.0], "via": [-0.3, 6 * np.pi - 0.3], "duration": 1.0}
    scene = yaw_and_pitch([0.0, 0.0, 1.0], path, {"rigid": HAND}, analysis=[INVERSE | {"output_step": 0.02}])
    pan = np.array(ffrobot.solve(scene)["inverse/joints/pan/coordinate"])
    np.testing.assert_allclose(pan[[0, -1]], [0.3, 0.3 - 6 * np.pi], atol=1e-9)
