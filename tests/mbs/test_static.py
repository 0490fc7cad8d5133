"""Static equilibrium: closed forms of a beam under its weight, and the moment that holds it."""

import numpy as np
import pytest
from beam_links import beam_link, rectangle

import ffrobot


def test_a_motor_holds_a_link_with_a_payload_although_its_path_would_accelerate():
    """The sag of a cantilever, by all 40 modes of 20 elements: Hermite elements are exact at their nodes."""
    length, payload, g, EI = 0.8, 0.3, 9.81, 70e9 * 0.02 * 0.01**3 / 12
    mass, modes = 2700.0 * 0.01 * 0.02 * length, {"count": 40, "family": "in-plane-bending", "attachment_modes": False}
    scene = ffrobot.make_scene(
        name="held", gravity=[0.0, -g],
        body=[{"name": "arm", "link": beam_link(length, rectangle(0.01, 0.02), 20, nu=None, modes=modes)}],
        joint=[{"name": "shoulder", "type": "revolute", "between": ["ground", "arm.root"]}],
        payload=[{"point": "arm.tip", "mass": payload}],
        trajectory=[{"name": "hold", "joint": "shoulder", "value": "0.4*t + 0.1*t**2"}],
        analysis=[{"name": "sag", "kind": "static"}],
    )  # fmt: skip
    sag = ffrobot.solve(scene)
    deflection = -g * length**3 / EI * (mass / 8 + payload / 3)
    assert sag["sag/points/arm.tip/deflection"][0, 1] == pytest.approx(deflection, rel=1e-8)
    assert sag["sag/joints/shoulder/moment"][0] == pytest.approx(g * length * (mass / 2 + payload), rel=1e-10)
    assert np.abs(sag["sag/joints/shoulder/rate"]).max() == 0.0
    assert np.abs(sag["sag/bodies/arm/modal_velocity"]).max() == 0.0
