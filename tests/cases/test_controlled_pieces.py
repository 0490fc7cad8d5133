"""Links in pieces in 3D in linear models and closed loops: as in the plane, and as the one link where it is stiff."""

import numpy as np
import pytest
from beam_links import beam_link, rectangle
from tables_3d import ORIGIN, revolute, scene

import ffrobot

S = "(10*t**3-15*t**4+6*t**5)"
INVERSE = {"name": "inverse", "kind": "pcid", "end": 0.1, "output_step": 0.01, "tolerance": 1e-8}
REST = {"name": "rest", "kind": "linear", "points": ["link2.tip", "link1.tip"]}
LOOP = {
    "name": "loop", "kind": "closed-loop", "end": 0.1, "output_step": 0.01, "tolerance": 1e-6, "sample_time": 1e-3,
    "actuation": "inverse", "unlimited": True, "tip": "link2.tip",
    "disturbance": [{"point": "link2.tip", "y": "5.0*sin(10*pi*t)**2"}],
    "sensor": [{"point": "link2.tip"}, {"modal": "link1"}, {"modal": "link2"}],
    "controller": [
        {"kind": "joint-pid", "proportional": {"O": 5.0, "A": 1.0}, "derivative": {"O": 0.05, "A": 0.01}}
    ],
}  # fmt: skip
LQR = {"kind": "lqr", "modes": 2, "moment": 0.1, "voltage": 10.0, "angle": 0.2, "rate": 2.0, "deflection": 0.05}
DESIGN = LOOP | {"name": "design", "controller": [LQR], "end": 0.003, "output_step": 0.001}


def arm(pieces, *analyses):
    """Two links whose joints are driven, from equilibrium."""
    families = ["in-plane-bending", "out-of-plane-bending", "torsion"]
    keys = {"nu": 0.3, "modes": {"count": 12, "family": families}, "damping": {"rayleigh": [0.0, 2e-4]}}
    divided = {} if pieces is None else {"pieces": pieces}
    bodies = [
        {"name": name, "link": beam_link(1.0, rectangle(0.01, 0.02), 12, condition=condition, **keys), **divided}
        for name, condition in (("link1", "simply-supported"), ("link2", "cantilever"))
    ]
    return scene(
        bodies,
        [revolute("O", "ground", "link1.root", [0.0, 0.6, 0.8]), revolute("A", "link1.tip", "link2.root")],
        *analyses,
        gravity=ORIGIN,
        geometric_stiffening=True,
        payload=[{"point": "link2.tip", "mass": 0.2, "center": [0.0, 0.05, 0.02]}],
        initial={"state": "static", "joints": {"O": 0.1, "A": 0.5}},
        trajectory=[
            {"name": "first", "joint": "O", "value": f"0.1+0.4*{S}"},
            {"name": "second", "joint": "A", "value": f"0.5-0.6*{S}"},
        ],
    )


def test_an_arm_that_bends_in_both_planes_and_twists():
    """In pieces and whole: frequencies, shapes of links, and a loop whose controller is designed for whole links.

    Without gravity: sag couples bending and twist of pieces, but not of the one link, whose file does not say so.
    """
    found = [ffrobot.solve(ffrobot.make_scene(**arm(pieces, INVERSE, REST, DESIGN))) for pieces in (None, 3)]
    with found[0] as one, found[1] as two:
        expected, frequency = (of["rest/linear/frequency"][0, :9] for of in (one, two))
        np.testing.assert_allclose(frequency[2:], expected[2:], rtol=2e-3)
        assert sorted(one.names("rest/linear/modes/link2")) == sorted(two.names("rest/linear/modes/link2"))
        for mode in range(2, 5):
            shapes = [of["rest/linear/modes/link2/modal"][0, mode, :4] for of in (one, two)]
            cosine = shapes[0] @ shapes[1] / np.prod([np.linalg.norm(shape) for shape in shapes])
            assert abs(cosine) == pytest.approx(1.0, abs=2e-3)
        for joint in "OA":
            commands = [of[f"design/joints/{joint}/moment"] for of in (one, two)]
            np.testing.assert_allclose(*commands, atol=1e-2 * np.abs(commands[0]).max())
