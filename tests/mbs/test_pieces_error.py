"""Rods with the strains of a piece, against helices, and what the equations of the piece miss of them."""

import numpy as np
import pytest
from beam_links import beam_link, rectangle
from scipy.spatial.transform import Rotation

from ffrobot.common.rotations import left_jacobian, logarithm
from ffrobot.fe_models.link import computed_modal_body
from ffrobot.fe_models.link_source import LinkTable
from ffrobot.mbs.model.body import from_modal_body
from ffrobot.mbs.quantities.attachment_error import ends_in_equations, rod_ends

L = 0.2
PIECE = beam_link(
    L,
    rectangle(0.005, 0.008),
    4,
    nu=0.3,
    condition="simply-supported",
    name="piece",
    modes={"count": 2, "family": ["in-plane-bending", "out-of-plane-bending", "torsion"], "attachment_modes": True},
)


@pytest.fixture(scope="module")
def piece(tmp_path_factory):
    return computed_modal_body(LinkTable(PIECE, tmp_path_factory.mktemp("piece") / "link.toml"))


def bent(piece, *curvatures):
    """P (T, n) of the file with constant curvatures (3,) 1/m."""
    turned = piece.stations.rotation - piece.stations.rotation[:1]
    x = piece.stations.position[:, 0]
    wanted = np.array([np.outer(x, k).ravel() for k in curvatures])
    p = np.linalg.lstsq(turned.reshape(-1, turned.shape[2]), wanted.T, rcond=None)[0].T
    np.testing.assert_allclose(np.einsum("kan,tn->tka", turned, p).reshape(len(p), -1), wanted, atol=1e-9)
    return p


OBLIQUE, HELIX = np.array([0.0, 0.9, -1.7]), np.array([0.8, 0.9, -1.7])


def test_constant_curvature_bends_to_a_helix(piece):
    A, r = rod_ends(piece, bent(piece, OBLIQUE, HELIX))
    for k, curvature in enumerate((OBLIQUE, HELIX)):
        np.testing.assert_allclose(A[k], Rotation.from_rotvec(curvature * L).as_matrix(), atol=1e-9)
        np.testing.assert_allclose(r[k], left_jacobian(curvature * L) @ [L, 0.0, 0.0], atol=1e-9)


def test_equations_miss_the_third_order(piece):
    """Of twist and bending in two planes, halved strains an eighth; of bending in one plane no rotation at all."""
    body = from_modal_body("piece", piece, stiffened=True)
    p = bent(piece, HELIX, HELIX / 2, OBLIQUE)
    (A, r), (A_known, r_known) = rod_ends(piece, p), ends_in_equations(body, p)
    turned = np.linalg.norm(logarithm(A @ np.swapaxes(A_known, -1, -2)), axis=1)
    moved = np.linalg.norm(r - r_known, axis=1) / L
    for missed in (turned, moved):
        assert np.log2(missed[0] / missed[1]) == pytest.approx(3.0, abs=0.3)
    assert turned[2] < 1e-9 < turned[1]
