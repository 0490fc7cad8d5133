"""Bodies: inertia about the link's axis, files without it, payloads, and what fewer modes keep exactly."""

from dataclasses import replace

import numpy as np
import pytest
from checkpoint_mechanisms import FOLDER
from links import ritz_link
from oracle_3d import body_mass_matrix
from random_mechanisms import random_beam, stiffened

from ffrobot.common.errors import InputError
from ffrobot.common.rotations import exponential
from ffrobot.fe_models.link import cached_modal_body
from ffrobot.mbs.model.body import bent_section, from_modal_body
from ffrobot.mbs.model.masses import with_payload
from ffrobot.mbs.model.truncation import with_fewer_modes


def upper():
    return cached_modal_body(FOLDER / "links" / "upper.toml").body


def test_straight_line_of_mass_has_inertia_about_its_axis():
    """J_11 = ρI_p l of a tube; twist couples with spin, and moves nothing along z."""
    link = upper()
    body = from_modal_body("upper", link)
    I_p = np.pi / 32 * (0.011**4 - 0.009**4)
    assert body.inertia[0, 0] == pytest.approx(2700.0 * I_p * 0.7, rel=1e-12)
    torsion = [family == "torsion" for family in link.family]
    assert np.all(np.abs(body.spin[0, torsion]) > 0)
    assert not np.any(np.abs(body.S_bar_kl[2, 2][np.ix_(torsion, torsion)]) > 1e-12)


def test_beam_of_an_earlier_version_is_refused_with_the_way_out():
    link = replace(upper(), J_spin=None, h_spin=None, S_spin=None)
    with pytest.raises(InputError, match=r'body "upper": expected .* inertia of the beam .* with `ffrobot link`'):
        from_modal_body("upper", link)
    whole = replace(link, kind="solid")  # integrated over its volume: nothing is missing
    assert from_modal_body("upper", whole).inertia[0, 0] == pytest.approx(link.second_moment[1, 1] * 2, abs=1e-15)


@pytest.mark.parametrize(("center", "bent"), [((0.03, -0.02, 0.05), 0.0), ((0.0, 0.0, 0.0), 1.0)])
def test_payload_has_the_energy_of_a_body_on_the_section(center, bent):
    """½ m |v_c|² + ½ Ωᵀ J Ω more than without, at any velocity; a point mass at any deflection. Modes are uncoupled."""
    rng = np.random.default_rng(4)
    bare = from_modal_body("upper", upper())
    center, J, m = np.array(center), np.diag([2e-3, 3e-3, 4e-3]) * (1.0 - bent), 0.6
    loaded = with_payload(bare, "tip", m, center, J)
    v, p = rng.standard_normal(6 + bare.n_modes), bent * rng.standard_normal(bare.n_modes)
    own, p_dot = loaded.modal_transform @ p, loaded.modal_transform @ v[6:]
    A = np.eye(3)

    def energy(body, p, v):
        return 0.5 * v @ body_mass_matrix(body, A, p) @ v

    at = bare.points["tip"]
    Omega = v[3:6] + at.rotation @ p_dot
    v_c = v[:3] + np.cross(v[3:6], at.position + at.translation @ own) + at.translation @ p_dot
    v_c += np.cross(Omega, center)
    expected = energy(bare, own, np.concatenate([v[:6], p_dot])) + 0.5 * m * v_c @ v_c + 0.5 * Omega @ J @ Omega
    assert energy(loaded, p, v) == pytest.approx(expected, rel=1e-12)
    np.testing.assert_allclose(loaded.first_moment, bare.first_moment + m * (at.position + center), rtol=1e-14)
    K = loaded.modal_transform.T @ np.diag(bare.stiffness) @ loaded.modal_transform
    np.testing.assert_allclose(K, np.diag(loaded.stiffness), atol=1e-9 * loaded.stiffness.max())
    assert np.all(loaded.stiffness < bare.stiffness * (1 + 1e-12))


def test_payload_of_a_stiffened_body_moves_to_second_order():
    """Integrals of G over points that turn with the section, from where they are at ±p: exp φ~ is not 1 + φ~."""
    rng = np.random.default_rng(6)
    bare = stiffened(rng, random_beam(rng, "b"))
    m, d = rng.uniform(0.1, 0.4, 5), 0.1 * rng.standard_normal((5, 3))
    center = m @ d / m.sum()
    spread = np.einsum("i,ik,il->kl", m, d - center, d - center)
    loaded = with_payload(bare, "tip", m.sum(), center, np.trace(spread) * np.eye(3) - spread)
    T, h, x = loaded.modal_transform, 1e-4, bare.points["tip"].position

    def points(p):
        at = bent_section(bare, "tip", p)
        return at.u + d @ exponential(at.phi).T

    for p in rng.standard_normal((4, bare.n_modes)):
        second = -(points(h * p) + points(-h * p) - 2 * points(0 * p)) / h**2  # pᵀG p of the points
        p_loaded = np.linalg.solve(T, p)
        for found, given, weights in (
            (loaded.stiffening.K_s, bare.stiffening.K_s, m[None]),
            (loaded.stiffening.K_x, bare.stiffening.K_x, m * (x + d).T),
        ):
            more = p_loaded @ found @ p_loaded - p @ given @ p
            np.testing.assert_allclose(more.reshape(-1, 3), weights @ second, atol=1e-5 * np.abs(second).max())


@pytest.fixture(params=["cantilever", "simply-supported"])
def whole(request):
    return ritz_link("link", request.param, modes=8, extra=1, damping_ratio=0.01, stiffening=True)


def test_equations_are_those_of_the_body_restricted_to_fewer_shapes(whole):
    """With m_ff = I and a diagonal stiffness, as of modes."""
    body = with_fewer_modes(whole, 3, ["root", "tip"])
    shapes = body.reduction.T
    K = shapes.T @ np.diag(whole.stiffness) @ shapes
    np.testing.assert_allclose(K, np.diag(body.stiffness), rtol=0, atol=1e-11 * body.stiffness[-1])
    assert np.all(shapes[np.abs(shapes).argmax(axis=0), np.arange(body.n_modes)] > 0)  # the same sign everywhere
    p = 1e-3 * np.random.default_rng(1).normal(size=body.n_modes)
    T, A = np.zeros((6 + whole.n_modes, 6 + body.n_modes)), exponential(np.array([0.0, 0.0, 0.7]))
    T[:6, :6], T[6:, 6:] = np.eye(6), shapes
    M, M_whole = body_mass_matrix(body, A, p), body_mass_matrix(whole, A, shapes @ p)
    np.testing.assert_allclose(M, T.T @ M_whole @ T, atol=1e-12)
    np.testing.assert_allclose(body.damping, shapes.T @ whole.damping @ shapes, atol=1e-12)
    K_tip, K_of_all = (of.stiffening.K_points["tip"][0] for of in (body, whole))
    np.testing.assert_allclose(p @ K_tip @ p, (T[6:, 6:] @ p) @ K_of_all @ (T[6:, 6:] @ p), rtol=1e-12)
