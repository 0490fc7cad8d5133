"""Orthotropic solids, and solids of several materials."""

import gmsh
import numpy as np
import pytest
from beam_links import solid_link
from solids import body_of, write_solid

import ffrobot
from ffrobot.common.errors import InputError


def orthotropic(E, nu, G):
    return {"youngs_modulus": E, "poissons_ratio": nu, "shear_modulus": G}


def test_equal_constants_are_isotropy(tmp_path):
    """Another form of the energy (6 × 6), the same numbers."""
    E, nu = 2.068427e11, 0.3
    options = {"divisions": (10, 1, 1), "count": 6, "family": "all"}
    plain = body_of(write_solid(tmp_path, **options))
    of = orthotropic([E] * 3, [nu] * 3, [E / 2 / (1 + nu)] * 3)
    same = body_of(write_solid(tmp_path, **options, material=of))
    np.testing.assert_allclose(same.frequency, plain.frequency, rtol=1e-9)
    np.testing.assert_allclose(same.S_bar_kl, plain.S_bar_kl, rtol=0, atol=1e-7)


def test_each_family_has_its_own_modulus(tmp_path):
    """Wood-like: bending and axial modes go by E_x, torsion by G_xy and G_xz, and nothing by E_y, E_z, G_yz."""
    rho, height, width = 500.0, 0.02, 0.02
    E = [12.0e9, 0.6e9, 0.9e9]
    of = orthotropic(E, [0.0, 0.0, 0.0], [0.8e9, 0.1e9, 0.8e9])
    section = {"height": height, "width": width, "cell": "hexahedron", "order": 2, "divisions": (40, 4, 4)}
    body = body_of(write_solid(tmp_path, rho=rho, **section, count=16, family="all", material=of))
    found = dict(zip(reversed(body.family), reversed(body.frequency), strict=True))  # the lowest of each
    # Simply supported: π/2L² √(EI/ρA) without shear; rod 1/4L √(E/ρ); torsion 1/4L √(GJ/ρI_p), J = 0.1406 a⁴ (square).
    assert found["axial"] == pytest.approx(np.sqrt(E[0] / rho) / 4, rel=2e-3)
    assert found["torsion"] == pytest.approx(np.sqrt(0.8e9 * 0.140577 / (rho / 6)) / 4, rel=5e-3)
    # Timoshenko's correction of the first mode, −(π²/2)(I/AL²)(1 + E/kG), with k = 5/6: 0.3 %.
    slender = np.pi / 2 * np.sqrt(E[0] * height**2 / 12 / rho)
    shear = np.pi**2 / 2 * height**2 / 12 * (1 + E[0] / (5 / 6 * 0.8e9))
    assert found["in-plane-bending"] == pytest.approx(slender * (1 - shear), rel=1e-3)


def test_a_region_that_is_not_in_the_mesh_is_refused(tmp_path):
    two_halves(tmp_path / "halves.msh")
    link = solid_link(1.0, None, {"order": 2}, name="halves", modes={"count": 2})
    link["geometry"] = {"kind": "solid", "length": 1.0, "file": str(tmp_path / "halves.msh")}
    link["region"] = [{"group": "outer_half", "material": link["material"]}]
    with pytest.raises(InputError, match=r"region.group: expected a volume group of the mesh \(inner, outer\), found"):
        ffrobot.make_link(link)


def two_halves(path):
    """A mesh of two boxes that share the face between them, with the volume groups inner and outer."""
    gmsh.initialize()
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("Mesh.MeshSizeMax", 0.02)
        boxes = [(3, gmsh.model.occ.addBox(x, -0.01, -0.01, 0.5, 0.02, 0.02)) for x in (0.0, 0.5)]
        gmsh.model.occ.fragment(boxes[:1], boxes[1:])
        gmsh.model.occ.synchronize()
        for number, name in enumerate(("inner", "outer"), start=1):
            gmsh.model.addPhysicalGroup(3, [number], number)
            gmsh.model.setPhysicalName(3, number, name)
        gmsh.model.mesh.generate(3)
        gmsh.write(str(path))
    finally:
        gmsh.finalize()
