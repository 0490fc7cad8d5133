"""The two couplings of patches to a solid, section rotations and surface strain, against each other and a beam."""

import meshio
import numpy as np
import pytest
from beam_links import link_keys, modal_body, paper_link
from patches_on_links import CERAMIC, on_link

import ffrobot
from ffrobot.common.errors import InputError
from ffrobot.run.solve import prepare_scene


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


@pytest.mark.parametrize("face", ["+y", "-y"])
def test_one_named_face_stretches_the_link_by_either_coupling(face):
    """With the force of the layer; on the surface it is 1 + t_p/t_b as large, to have the layer's moment."""
    body = link("both", 8, ["in-plane-bending", "axial"])
    by_faces, by_sections = (
        on_link(body, coupling=coupling, face=face).Phi_V[body.family.index("axial")]
        for coupling in ("surface", "rotation")
    )
    np.testing.assert_allclose(by_faces, (1 + 0.75 / 15) * by_sections, atol=1e-2 * np.abs(by_sections).max())


def test_ceramic_held_across_bends_a_solid_as_one_that_strains_along_it_alone():
    """N = E d31/(1 − ν) in both directions of a face that contracts by ν: 1 in the middle of a slender bar."""
    body = link("both")
    along, both = (on_link(body, coupling="surface", **keys).Phi_V for keys in ({}, {"poissons_ratio": 0.3}))
    assert difference(both[:1], along[:1]).max() < 5e-3


@pytest.mark.parametrize(("faces", "face"), [("top", "-y"), ("bottom", "+y"), ("top", "both")])
def test_patches_on_faces_without_outlines_are_refused(faces, face):
    with pytest.raises(InputError, match="face: expected patches on faces that the link file outlines"):
        on_link(link(faces), coupling="surface", face=face)


LENGTH, E = 0.6, 7e10
WIDTHS, LEVELS = (0.01, 0.01, 0.01, 0.03), (0.0, 0.01, 0.02, 0.03, 0.035)
"""Of a T: a web of 0.01 × 0.03 m below a flange of 0.03 × 0.005 m."""


@pytest.fixture(scope="module")
def tee(tmp_path_factory):
    """Its link, x along the axis through the centers of area, its area, EI and the levels of its faces from there."""
    z = np.array([-0.015, -0.005, 0.005, 0.015])
    points = np.stack(np.meshgrid(np.linspace(0, LENGTH, 13), LEVELS, z, indexing="ij"), axis=-1).reshape(-1, 3)
    n = np.arange(len(points)).reshape(13, len(LEVELS), 4)
    around = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))
    cells = [
        [n[i + a, j + b, k + c] for a, b, c in around]
        for i in range(12) for j in range(4) for k in ((0, 1, 2) if j == 3 else (1,))
    ]  # fmt: skip
    path = tmp_path_factory.mktemp("tee") / "tee.vtk"
    meshio.write(path, meshio.Mesh(points, [("hexahedron", np.array(cells))]))
    heights, middles = np.diff(LEVELS), np.add(LEVELS[1:], LEVELS[:-1]) / 2
    areas = WIDTHS * heights
    center = areas @ middles / areas.sum()
    moment = areas @ (heights**2 / 12 + (middles - center) ** 2)
    keys = link_keys("solid", LENGTH, None, {"order": 2}, E=E, nu=0.0, name="tee")
    keys["geometry"] = {"kind": "solid", "length": LENGTH, "file": str(path), "origin": [0.0, center, 0.0]}
    keys["modes"] = {"count": 4, "family": ["in-plane-bending", "axial"]}
    return keys, areas.sum(), E * moment, (LEVELS[-1] - center, center)


@pytest.mark.parametrize(("face", "sign"), [("+y", -1.0), ("-y", 1.0)])
def test_faces_at_unequal_distances_from_the_axis(tee, face, sign):
    """Rotation and way of the tip by one patch: M L_p/EI with the arm of its own layer, and N L_p/EA."""
    keys, area, EI, distances = tee
    body = modal_body(keys)
    phi = on_link(body, face=face, centers=(0.3,), length=0.3).Phi_V[:, 0] / np.diag(body.stiffness)
    tip, N = body.interfaces["tip"], CERAMIC["modulus"] * CERAMIC["d31"] * CERAMIC["width"]
    arm = distances[0 if face == "+y" else 1] + CERAMIC["thickness"] / 2
    np.testing.assert_allclose(tip.rotation[2] @ phi, N * arm * 0.3 / EI, rtol=1e-6)
    np.testing.assert_allclose(tip.translation[0] @ phi, sign * N * 0.3 / (E * area), rtol=1e-6)


@pytest.mark.parametrize("face", [None, "+y"])
def test_patches_off_the_axis_without_face_are_told(tee, face):
    patches = (
        CERAMIC | {"body": "tee", "count": 5, "allocation": "least-squares"} | ({} if face is None else {"face": face})
    )
    wall = {"name": "wall", "type": "weld", "between": ["ground", "tee.root"]}
    keys = {"body": [{"name": "tee", "link": tee[0]}], "joint": [wall], "pzt": [patches], "gravity": [0.0, 0.0]}
    solution = prepare_scene(ffrobot.make_scene(name="tee", analysis=[{"name": "rest", "kind": "static"}], **keys))
    told = 'axis of "tee" is up to 3.3 mm off the middle between its faces'
    assert any(told in note for note in solution.notes) == (face is None)
