"""What a scene in space takes from modal bodies and rigid ones: inertia about the link's axis, files without it."""

from dataclasses import replace

import numpy as np
import pytest
from spatial_checkpoints import modal_body

from ffrobot.common.errors import InputError
from ffrobot.mbs.model.spatial_body import from_modal_body, rigid_body


def test_straight_line_of_mass_has_inertia_about_its_axis():
    """J_11 = ρI_p l of a tube; twist couples with spin, and moves nothing along z."""
    link = modal_body("links/upper.toml")
    body = from_modal_body("upper", link)
    I_p = np.pi / 32 * (0.011**4 - 0.009**4)
    assert body.inertia[0, 0] == pytest.approx(2700.0 * I_p * 0.7, rel=1e-12)
    torsion = [family == "torsion" for family in link.family]
    assert np.all(np.abs(body.spin[0, torsion]) > 0)
    assert not np.any(np.abs(body.S_bar_kl[2, 2][np.ix_(torsion, torsion)]) > 1e-12)


def test_all_of_the_kinetic_energy_is_positive():
    """M of the straight link, its frame held nowhere, has no singular direction."""
    body = from_modal_body("upper", modal_body("links/upper.toml"))
    s = body.first_moment
    cross = np.array([[0, -s[2], s[1]], [s[2], 0, -s[0]], [-s[1], s[0], 0]])
    m, J, h = body.mass * np.eye(3), body.inertia, body.spin
    M = np.block([[m, -cross, body.S_bar], [cross, J, h], [body.S_bar.T, h.T, np.eye(body.n_modes)]])
    scale = 1 / np.sqrt(np.diag(M))
    assert np.linalg.eigvalsh(scale[:, None] * M * scale).min() > 1e-4


def test_beam_of_an_earlier_version_is_refused_with_the_way_out():
    link = replace(modal_body("links/upper.toml"), J_spin=None, h_spin=None, S_spin=None)
    with pytest.raises(InputError, match=r'body "upper": expected .* inertia of the beam .* with `ffrobot link`'):
        from_modal_body("upper", link)
    whole = replace(link, kind="solid")  # integrated over its volume: nothing is missing
    assert from_modal_body("upper", whole).inertia[0, 0] == pytest.approx(link.second_moment[1, 1] * 2, abs=1e-15)


def test_rigid_body_about_its_origin():
    """Steiner's theorem, with products of inertia."""
    inertia, c = np.array([[0.3, 0.02, 0.01], [0.02, 0.4, -0.03], [0.01, -0.03, 0.5]]), np.array([0.1, -0.2, 0.3])
    body = rigid_body("b", 2.0, c, inertia, {"root": np.zeros(3), "tip": np.array([0.4, 0, 0])})
    np.testing.assert_allclose(body.inertia, inertia + 2.0 * (c @ c * np.eye(3) - np.outer(c, c)), rtol=1e-14)
    np.testing.assert_allclose(body.points["mid"].position, [0.2, 0, 0])
    assert body.n_modes == 0
