"""Bodies with fewer modes: what they keep exactly, whatever is left out."""

import numpy as np
import pytest
from links import ritz_link
from oracle_3d import body_mass_matrix

from ffrobot.common.rotations import exponential
from ffrobot.mbs.model.truncation import with_fewer_modes as with_fewer_modes

POINTS = ["root", "tip"]


@pytest.fixture(params=["cantilever", "simply-supported"])
def whole(request):
    return ritz_link("link", request.param, modes=8, extra=1, damping_ratio=0.01, stiffening=True)


def test_the_coordinates_are_orthonormal_and_uncoupled(whole):
    body = with_fewer_modes(whole, 3, POINTS)
    T = body.reduction.T
    np.testing.assert_allclose(T.T @ T, np.eye(body.n_modes), atol=1e-12)
    K = T.T @ np.diag(whole.stiffness) @ T
    np.testing.assert_allclose(K, np.diag(body.stiffness), rtol=0, atol=1e-11 * body.stiffness[-1])
    assert np.all(T[np.abs(T).argmax(axis=0), np.arange(body.n_modes)] > 0)  # the same sign on every machine


def test_equations_are_those_of_the_body_restricted_to_fewer_shapes(whole):
    body = with_fewer_modes(whole, 3, POINTS)
    p = 1e-3 * np.random.default_rng(1).normal(size=body.n_modes)
    T, A = np.zeros((6 + whole.n_modes, 6 + body.n_modes)), exponential(np.array([0.0, 0.0, 0.7]))
    T[:6, :6], T[6:, 6:] = np.eye(6), body.reduction.T
    M, M_whole = body_mass_matrix(body, A, p), body_mass_matrix(whole, A, body.reduction.T @ p)
    np.testing.assert_allclose(M, T.T @ M_whole @ T, atol=1e-12)
    np.testing.assert_allclose(body.damping, body.reduction.T.T @ whole.damping @ body.reduction.T, atol=1e-12)
    K_tip, K_of_all = (of.stiffening.K_points["tip"][0] for of in (body, whole))
    np.testing.assert_allclose(p @ K_tip @ p, (T[6:, 6:] @ p) @ K_of_all @ (T[6:, 6:] @ p), rtol=1e-12)
