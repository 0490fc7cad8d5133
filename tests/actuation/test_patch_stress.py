"""Stress in a link under its patches: what their strain does to the sections there, which modes show late."""

import numpy as np
import pytest
from patched_strip import END, START, E, solved, strain

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
