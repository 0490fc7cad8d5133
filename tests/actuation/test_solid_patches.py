"""The two couplings of patches to a solid, section rotations and surface strain, against each other and a beam."""

import numpy as np
import pytest
from beam_links import modal_body, paper_link
from patches_on_links import on_link

from ffrobot.common.errors import InputError


def link(faces=None, count=6, family="in-plane-bending"):
    """A beam, or a solid that has ten patches outlined on `faces`."""
    keys = paper_link("simply-supported", count, family)
    if faces is None:
        keys |= {"mesh": {"elements": 40}, "model": {"theory": "timoshenko"}}
    else:
        keys["geometry"] |= {"kind": "solid"}
        keys |= {"mesh": {"size": 0.025}}
        keys["surface_patch"] = {"count": 10, "length": 0.05, "width": 0.025, "faces": faces}
    return modal_body(keys)


def Phi_V(faces=None, coupling="rotation"):
    """Of ten patches on the link, by either coupling."""
    return on_link(link(faces), coupling=coupling).Phi_V


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


@pytest.mark.parametrize("face", ["+y", "-y"])
def test_one_named_face_stretches_the_link_by_either_coupling(face):
    """With the force of the layer; on the surface it is 1 + t_p/t_b as large, to have the layer's moment."""
    body = link("both", 8, ["in-plane-bending", "axial"])
    by_faces, by_sections = (
        on_link(body, coupling=coupling, face=face).Phi_V[body.family.index("axial")]
        for coupling in ("surface", "rotation")
    )
    np.testing.assert_allclose(by_faces, (1 + 0.75 / 15) * by_sections, atol=1e-2 * np.abs(by_sections).max())


@pytest.mark.parametrize(("faces", "face"), [("top", "-y"), ("bottom", "+y"), ("top", "both")])
def test_patches_on_faces_without_outlines_are_refused(faces, face):
    with pytest.raises(InputError, match="face: expected patches on faces that the link file outlines"):
        on_link(link(faces), coupling="surface", face=face)
