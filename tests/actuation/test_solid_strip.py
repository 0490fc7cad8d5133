"""Patches as built against a strip and its layer as a solid, which knows neither sections nor neutral axes."""

import numpy as np
import pytest
from beam_links import beam_link, modal_body, rectangle
from patches_on_links import SCENE, patched
from solid_strip import SolidStrip

from ffrobot.actuation.patches.link_patches import link_patches
from ffrobot.actuation.patches.records import PztLayout
from ffrobot.common.validation import validate

STRIP = {"size": (0.4, 0.003, 0.02), "E": 70e9, "nu": 0.33, "rho": 2700.0}
CERAMIC = {"E": 61e9, "nu": 0.35, "rho": 7700.0, "d31": -179e-12, "permittivity": 1700 * 8.8541878128e-12}
PLACES = {  # begin and end, thickness, width, offset, m
    "wide": (0.1, 0.16, 0.25e-3, 0.02, 0.0),
    "offset": (0.1, 0.16, 0.25e-3, 0.008, 0.006),
    "near the clamp": (0.005, 0.065, 0.25e-3, 0.02, 0.0),
    "thick": (0.1, 0.16, 0.5e-3, 0.02, 0.0),
}


@pytest.fixture(scope="module")
def strip():
    L, h, b = STRIP["size"]
    modes = {"count": 10, "family": ["in-plane-bending", "out-of-plane-bending", "axial"]}
    return modal_body(beam_link(L, rectangle(h, b), 30, E=STRIP["E"], nu=STRIP["nu"], rho=STRIP["rho"], modes=modes))


@pytest.mark.parametrize(
    ("name", "close", "of_charge"),
    [("wide", 0.002, 0.12), ("offset", 0.01, 0.15), ("near the clamp", 0.025, 0.07), ("thick", 0.025, 0.25)],
)
def test_one_patch_on_a_strip(strip, name, close, of_charge):
    """Frequency 0.5 %, tip per volt 2.5 %; how far open electrodes raise the frequency.

    The clamp keeps sections flat over half their width: a patch there is held across, and that of the model is not. For
    electric charge the model holds all patches across, while the strip gives way.
    """
    start, end, t, w, offset = PLACES[name]
    solid = SolidStrip(STRIP, CERAMIC | {"place": PLACES[name]}, size=0.0075)
    keys = {
        "body": "link", "centers": ((start + end) / 2,), "length": end - start, "thickness": t, "width": w,
        "offset": offset, "face": "+y", "modulus": CERAMIC["E"], "d31": CERAMIC["d31"], "density": CERAMIC["rho"],
        "poissons_ratio": CERAMIC["nu"], "permittivity": CERAMIC["permittivity"], "structural": True,
    }  # fmt: skip
    layouts = [validate(PztLayout, keys | of, SCENE) for of in ({}, {"electrodes": "open"})]
    bodies = [patched(strip, of) for of in layouts]
    shorted, opened = (np.sqrt(body.stiffness.min()) / (2 * np.pi) for body in bodies)
    found = solid.frequency("shorted"), solid.frequency("open")
    assert shorted == pytest.approx(found[0], rel=0.005)
    assert opened / shorted - 1 == pytest.approx(found[1] / found[0] - 1, rel=of_charge)
    of_link = link_patches(layouts[:1], strip, bodies[0])
    p = bodies[0].modal_transform.T @ of_link.Phi_V[:, 0] / bodies[0].stiffness
    moved, expected = bodies[0].points["tip"].translation @ p, solid.tip_per_volt()
    assert moved[1] == pytest.approx(expected[1], rel=close)
    assert moved[2] == pytest.approx(expected[2], rel=close, abs=1e-4 * abs(expected[1]))
