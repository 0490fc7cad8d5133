"""Quadratic and linear programs along time, against closed forms of the double integrator."""

import numpy as np
import pytest

from ffrobot.mbs.tracking.interior_point import Program, minimize

N = 100


def to_one(most, *, is_effort):
    """x'' = u from rest at 0 to rest at 1 in 1 s, u linear between breaks: x = (position, speed, u, share)."""
    h, s = 1.0 / N, 4
    F, G = np.zeros((N, 3, s)), np.zeros((N, 3, s))
    F[:, :2, :2], G[:, :2, :2] = -np.array([[1, h], [0, 1]]), np.eye(2)
    F[:, :2, 2], G[:, :2, 2] = (-h * h / 3, -h / 2), (-h * h / 6, -h / 2)
    F[:, 2, 3], G[:, 2, 3] = -1.0, 1.0  # the share is a constant
    H, g = np.zeros((N, 2 * s, 2 * s)), np.zeros((N, 2 * s))
    C, d = np.zeros((N, 4, 2 * s)), np.full((N, 4), most)
    C[:, [0, 1], 2], C[:, [2, 3], s + 2] = (1.0, -1.0), (1.0, -1.0)
    if is_effort:
        H[:, 2, 2] = H[:, s + 2, s + 2] = h / 3
        H[:, 2, s + 2] = H[:, s + 2, 2] = h / 6
        H[:, 3, 3] = 1.0
    else:
        g[0, 3], d[:] = 1.0, 0.0
        C[:, :, 3] = -1.0
    rows = np.eye(s)[:2]
    ends = (rows, np.zeros(2)), (rows, np.array([1.0, 0.0]))
    return Program(H, g, F, G, np.zeros((N, 3)), *ends, C, d)


def test_least_effort_within_limits():
    """At the limit up to t₁ and from 1 − t₁ on, u = most (1 − 2t)/(1 − 2t₁) between; x(1) = 1 fixes t₁."""
    most = 5.0
    found = minimize(to_one(most, is_effort=True))
    # x(1) = ∫ (1 − t) u dt = most/4 − most (1 − 2 t₁)²/12 = 1
    first = 0.5 * (1 - np.sqrt(12 * (most / 4 - 1) / most))
    t = np.linspace(0, 1, N + 1)
    expected = np.clip(most * (1 - 2 * t) / (1 - 2 * first), -most, most)
    assert found.converged
    assert np.abs(found.x[:, 2] - expected).max() < 0.02  # by the piece in which the limit is left
    assert np.abs(found.x[:, 2]).max() <= most * (1 + 1e-9)


def test_least_limit():
    """Bang and bang: 4, for an even number of intervals but for the one in which u changes sign."""
    found = minimize(to_one(0.0, is_effort=False))
    assert found.converged
    assert found.x[0, 3] == pytest.approx(4.0, rel=2e-4)
    assert found.x[0, 3] >= 4.0


def test_nothing_is_found_beyond_what_limits_allow():
    assert not minimize(to_one(3.9, is_effort=True)).converged
