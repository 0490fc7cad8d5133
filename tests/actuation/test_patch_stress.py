"""A cantilever strip of aluminium under the voltage of its patches: its tip, and the stress in it.

The strain of patches acts on the sections there, which modes show late.
"""

import numpy as np
import pytest
from beam_links import beam_link, rectangle
from one_link import one_link

import ffrobot

E, L, B = 70e9, 0.3, 0.02
E_P, D31, T_P = 63e9, 110e-12, 0.5e-3
START, END, VOLT = 0.045, 0.105, 100.0


def solved(height, face, modes, pieces=1, places=()):
    """Results; stress points p0 … on the upper side at `places`."""
    stress = {"points": {f"p{k}": [x, height / 2, 0.0] for k, x in enumerate(places)}}
    modes = {"family": "in-plane-bending"} | modes
    link = beam_link(L, rectangle(height, B), 40, E=E, nu=0.3, name="strip", modes=modes, stress=stress)
    centers, on = [(START + END) / 2], {"face": face} if face else {}
    pzt = {"body": "strip", "centers": centers, "length": END - START, "width": B, "thickness": T_P, **on}
    keys = {"body": [{"name": "strip", "link": link, "pieces": pieces}], "pzt": [pzt | {"modulus": E_P, "d31": D31}]}
    load = [{"pzt": "strip", "voltage": [f"{VOLT}"]}]
    return ffrobot.solve(one_link("strip", link, {"name": "bent", "kind": "static"}, load=load, **keys))


def strain(height, faces):
    """(2,) curvature (1/m) and stretch of the axis under the patches: section loads of the free strain Λ in the layers
    over the composite section's 2 × 2 stiffness.
    """
    A, S, I = (B * np.diff([(height / 2) ** k, (height / 2 + T_P) ** k])[0] / k for k in (1, 2, 3))  # noqa: E741
    if faces == 2:
        A, S, I, moment = 2 * A, 0.0, 2 * I, 2 * S  # noqa: E741
    else:
        moment = S
    stiffness = np.diag([E * B * height**3 / 12, E * B * height]) + E_P * np.array([[I, -S], [-S, A]])
    free = E_P * D31 * VOLT / T_P * np.array([moment, -A if faces == 1 else 0.0])
    return np.linalg.solve(stiffness, free)


@pytest.mark.parametrize("face", ["both", "-y"])
def test_composite_section_of_a_link_in_pieces(face):
    """A cut at 75 mm, under the patch. What is left is the foreshortening of pieces, which always have stiffening."""
    expected = strain(0.004, 2 if face == "both" else 1)[0] * (END - START) * (L - (START + END) / 2)
    tip = solved(0.004, face, {}, pieces=4)["bent/points/strip.tip/deflection"][0, 1]
    assert tip == pytest.approx(expected, rel=1e-6)


PLACES = (0.03, START + 0.005, (START + END) / 2, END - 0.005, 0.15)
MODES = {"count": 4, "attachment_modes": False}


def stress(results):
    return np.array([results[f"bent/stress/strip/points/p{k}/stress"][0, 0] for k in range(len(PLACES))])


@pytest.mark.parametrize("height", [0.004, 0.002])
@pytest.mark.parametrize(("face", "faces"), [("both", 2), (None, 1)])
def test_composite_section(height, face, faces):
    """−E y φ' under the patch and nothing beside it: with four modes, at ψ 8.9 and 4.4."""
    found = stress(solved(height, face, MODES, places=PLACES))
    curvature = strain(height, faces)[0]
    largest = E * height / 2 * curvature
    np.testing.assert_allclose(found, [0, *(-largest,) * 3, 0], atol=2e-3 * largest)


def test_pull_of_a_named_face():
    """E (u' − y φ'), though the modes only bend."""
    height = 0.004
    found = stress(solved(height, "+y", MODES | {"family": ["in-plane-bending", "axial"], "count": 6}, places=PLACES))
    curvature, stretch = strain(height, 1)
    expected = E * (stretch - height / 2 * curvature)
    np.testing.assert_allclose(found, [0, *(expected,) * 3, 0], atol=5e-3 * abs(expected))
