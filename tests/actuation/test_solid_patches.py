"""The two couplings of patches to a solid, section rotations and surface strain, against each other and a beam."""

import numpy as np
import pytest
from beam_links import modal_body, paper_link
from patches_on_links import on_link


def Phi_V(faces=None, coupling="rotation"):
    """Of ten patches on a beam, or on a solid that has them outlined on `faces`, by either coupling."""
    keys = paper_link("simply-supported", 6)
    if faces is None:
        keys |= {"mesh": {"elements": 40}, "model": {"theory": "timoshenko"}}
    else:
        keys["geometry"] |= {"kind": "solid"}
        keys |= {"mesh": {"size": 0.025}}
        keys["surface_patch"] = {"count": 10, "length": 0.05, "width": 0.025, "faces": faces}
    return on_link(modal_body(keys), coupling=coupling).Phi_V


def difference(found, expected):
    """By mode, relative to the mode's largest entry."""
    return np.abs(found - expected).max(axis=1) / np.abs(expected).max(axis=1)


def test_section_rotations_are_those_of_the_beam():
    assert difference(Phi_V("both"), Phi_V()).max() < 2e-3


@pytest.mark.parametrize(("faces", "limit"), [("both", 4e-3), ("top", 4e-3)])
def test_surface_strain_agrees_with_section_rotations(faces, limit):
    """Found: 8e-5 in mode 1, growing with the square of its number to 3e-3 in mode 6: shear warps the sections."""
    found = difference(Phi_V(faces, "surface"), Phi_V(faces))
    assert found[0] < 2e-4
    assert found.max() < limit


def test_one_face_or_two_bend_alike():
    """Bending modes of a symmetric link have no mean axial strain for a single face to work on."""
    np.testing.assert_allclose(
        Phi_V("top", "surface"), Phi_V("both", "surface"), atol=1e-3 * np.abs(Phi_V("both", "surface")).max()
    )
