"""Gauss collocation of second-order boundary value problems against solutions that are known."""

import numpy as np
from scipy.interpolate import PPoly

from ffrobot.mbs.inversion.collocation import Boundary, Problem, collocate

SIGMA = np.array([30.0, 2e4])  # 1/s: p̈ = σ² p + f has the motions e^(σt) and e^(−σt)


def bell(t):
    """p, ṗ, p̈ (N, 2) of a pulse that is over at 0 and 2."""
    x = (np.asarray(t)[:, None] - 1) / np.array([0.15, 0.2])
    p = np.exp(-(x**2))
    width = np.array([0.15, 0.2])
    return p, -2 * x * p / width, (4 * x**2 - 2) * p / width**2


def dichotomy():
    """Of p̈ = σ² p + f, f such that `bell` is the bounded solution: decaying parts vanish at 0, growing ones at 2."""

    def residual(t, p, v, a):
        known = bell(t)
        return a - SIGMA**2 * p - (known[2] - SIGMA**2 * known[0])

    def derivatives(t):
        one = np.broadcast_to(np.eye(2), (len(t), 2, 2))
        return np.array([one, 0 * one, -np.diag(SIGMA**2) * one])

    rest = np.zeros(4)
    no_decaying, no_growing = (np.hstack([-sign * np.diag(SIGMA), np.eye(2)]) for sign in (1, -1))
    return Problem(residual, derivatives, SIGMA, 1.0, Boundary(no_decaying, rest), Boundary(no_growing, rest))


def error_at_breaks(intervals):
    breaks = np.linspace(0, 2, intervals + 1)
    found = collocate(dichotomy(), breaks, PPoly(np.zeros((1, 1, 2)), [0, 2]))
    assert found.converged
    return np.abs(found.curve(breaks) - bell(breaks)[0]).max(axis=0)


def test_order_at_the_breaks_is_twice_the_number_of_points():
    """Superconvergence h⁸ of four Gauss points, where intervals resolve the motion (Ascher et al. 1995, ch. 5)."""
    errors = [error_at_breaks(n)[0] for n in (20, 40)]
    assert np.log2(errors[0] / errors[1]) > 7.0


def test_intervals_need_not_resolve_fast_growing_and_decaying_motions():
    """σh = 1000 in the second component: forward integration would grow by e^40000."""
    assert error_at_breaks(40)[1] < 1e-4
