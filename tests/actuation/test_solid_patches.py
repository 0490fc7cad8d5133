"""The two couplings of patches to a solid, section rotations and surface strain, against each other and a beam."""

import numpy as np
import pytest
from patches_on_links import on_link

from ffrobot.fe_models.link import cached_modal_body

LINK = """
name = "link"
[material]
youngs_modulus = 2.068427e11
poissons_ratio = 0.3
density = 7850.0
[geometry]
length = 1.0
section = { shape = "rectangle", height = 0.015, width = 0.025 }
KIND
[reference]
condition = "simply-supported"
[modes]
attachment_modes = false
count = 6
family = "in-plane-bending"
"""
BEAM = 'kind = "beam"\n[mesh]\nelements = 40\n[model]\ntheory = "timoshenko"'
SOLID = (
    'kind = "solid"\n[mesh]\nsize = 0.025\n[surface_patch]\ncount = 10\nlength = 0.05\nwidth = 0.025\nfaces = "FACES"'
)


@pytest.fixture(scope="module")
def arrays(tmp_path_factory):
    """Φ_V of ten patches: of a beam or of a solid with patches on `faces`, by either coupling."""
    folder = tmp_path_factory.mktemp("solid")
    bodies = {}

    def compute(faces=None, coupling="rotation"):
        if faces not in bodies:
            path = folder / f"{faces}.toml"
            path.write_text(LINK.replace("KIND", BEAM if faces is None else SOLID.replace("FACES", faces)))
            with pytest.MonkeyPatch.context() as patch:
                patch.setenv("XDG_CACHE_HOME", str(folder / "cache"))
                bodies[faces] = cached_modal_body(path).body
        body = bodies[faces]
        return on_link(body, coupling=coupling).Phi_V

    return compute


def difference(found, expected):
    """By mode, relative to the mode's largest entry."""
    return np.abs(found - expected).max(axis=1) / np.abs(expected).max(axis=1)


def test_section_rotations_are_those_of_the_beam(arrays):
    assert difference(arrays("both"), arrays()).max() < 2e-3


@pytest.mark.parametrize(("faces", "limit"), [("both", 4e-3), ("top", 4e-3)])
def test_surface_strain_agrees_with_section_rotations(arrays, faces, limit):
    """Found: 8e-5 in mode 1, growing with the square of its number to 3e-3 in mode 6: shear warps the sections."""
    found = difference(arrays(faces, "surface"), arrays(faces))
    assert found[0] < 2e-4
    assert found.max() < limit


def test_one_face_or_two_bend_alike(arrays):
    """Bending modes of a symmetric link have no mean axial strain for a single face to work on."""
    np.testing.assert_allclose(
        arrays("top", "surface"), arrays("both", "surface"), atol=1e-3 * np.abs(arrays("both", "surface")).max()
    )
