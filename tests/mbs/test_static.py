"""Static equilibrium: closed forms of a beam under its weight, and the moments that hold it."""

import numpy as np
import pytest

import ffrobot

LINK = """
name = "arm"
[material]
youngs_modulus = 70e9
density = 2700.0
[geometry]
kind = "beam"
length = 0.8
section = { shape = "rectangle", height = 0.01, width = 0.02 }
[mesh]
elements = 20
[reference]
condition = "cantilever"
[modes]
attachment_modes = false
count = 40
family = "in-plane-bending"
"""

SCENE = """
name = "held_arm"
gravity = [0.0, -9.81]
[[body]]
name = "arm"
link = "arm.toml"
[[joint]]
name = "shoulder"
type = "revolute"
between = ["ground", "arm.root"]
[[payload]]
point = "arm.tip"
mass = 0.3
[[trajectory]]
name = "hold"
joint = "shoulder"
value = "0.4*t + 0.1*t**2"
[[analysis]]
name = "sag"
kind = "static"
"""

MASS, LENGTH, PAYLOAD, GRAVITY = 2700.0 * 0.01 * 0.02 * 0.8, 0.8, 0.3, 9.81
EI = 70e9 * 0.02 * 0.01**3 / 12


@pytest.fixture(scope="module")
def sag(tmp_path_factory):
    folder = tmp_path_factory.mktemp("static")
    (folder / "arm.toml").write_text(LINK)
    (folder / "scene.toml").write_text(SCENE)
    return ffrobot.solve(folder / "scene.toml")


def test_tip_sags_as_a_cantilever_under_its_weight_and_the_payload(sag):
    """All 40 modes of 20 elements: Hermite elements are exact at their nodes."""
    closed_form = -GRAVITY * LENGTH**3 / EI * (MASS / 8 + PAYLOAD / 3)
    assert sag["sag/points/arm.tip/deflection"][0, 1] == pytest.approx(closed_form, rel=1e-8)


def test_motor_holds_the_weight_at_its_lever_although_the_path_would_accelerate(sag):
    closed_form = GRAVITY * LENGTH * (MASS / 2 + PAYLOAD)
    assert sag["sag/joints/shoulder/moment"][0] == pytest.approx(closed_form, rel=1e-10)
    assert np.abs(sag["sag/joints/shoulder/rate"]).max() == 0.0
    assert np.abs(sag["sag/bodies/arm/modal_velocity"]).max() == 0.0
