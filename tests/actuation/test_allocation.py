"""Bounded least squares of voltages against SciPy's, its optimality conditions, and what may never happen."""

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from ffrobot.mbs import _core

RIDGE = 1e-8  # of the forces may be left where many voltages would do: picking the smallest costs so much at most


def allocation(Phi, limit, W_sqrt=None, lower=None):
    n = len(Phi)
    W_sqrt = np.eye(n) if W_sqrt is None else W_sqrt
    scale = np.where(np.isfinite(limit), limit, 1.0)
    gain = scale[:, None] * np.linalg.pinv(W_sqrt @ Phi * scale) @ W_sqrt
    return _core.Allocation(Phi, W_sqrt, gain, -limit if lower is None else lower, limit, scale)


def history(rng, count, n, size):
    """Smooth modal forces (count, n) that take voltages in and out of their limits."""
    t = np.linspace(0, 1, count)[:, None]
    return size * np.sin(t * rng.uniform(5, 60, n) + rng.uniform(0, 6, n)) * rng.uniform(0.2, 2, n)


@pytest.mark.parametrize(("n", "k"), [(10, 10), (10, 4), (6, 14), (20, 20)])
def test_agrees_with_scipy(n, k):
    rng = np.random.default_rng(n + k)
    Phi, limit, lower = rng.standard_normal((n, k)), rng.uniform(0.5, 2.0, k), rng.uniform(-1.0, -0.1, k)
    F = history(rng, 50, n, 4.0)
    V = allocation(Phi, limit, lower=lower).solve(F)
    expected = np.array([lsq_linear(Phi, f, (lower, limit), method="bvls", tol=1e-14).x for f in F])
    cost, least = (np.linalg.norm(F - x @ Phi.T, axis=1) for x in (V, expected))
    np.testing.assert_allclose(cost, least, rtol=1e-9, atol=RIDGE * np.abs(F).max())
    if k <= n:  # unique
        np.testing.assert_allclose(V, expected, atol=1e-8)


@pytest.mark.parametrize("weights", ["modes", "points"])
def test_weighted_solutions_are_optimal(weights):
    """No voltage inside its limits has a gradient, none at its limit one that points inwards."""
    rng = np.random.default_rng(5)
    Phi, limit = rng.standard_normal((8, 12)), rng.uniform(0.1, 1.0, 12)
    W_sqrt = np.diag(rng.uniform(0.0, 3.0, 8)) if weights == "modes" else rng.standard_normal((2, 8))
    F = history(rng, 40, 8, 30.0)
    V = allocation(Phi, limit, W_sqrt).solve(F)
    assert np.all(np.abs(V) <= limit)
    A = W_sqrt @ Phi
    gradient = (V @ A.T - F @ W_sqrt.T) @ A
    size = np.abs(A).max() ** 2 * len(limit) + np.abs(F @ W_sqrt.T @ A).max()
    inside = np.abs(V) < limit * (1 - 1e-12)
    assert np.abs(gradient[inside]).max(initial=0.0) < 1e-9 * size
    assert np.all(gradient[~inside] * np.sign(V[~inside]) < 1e-9 * size)


def test_within_the_limits_the_unlimited_solution_is_taken():
    rng = np.random.default_rng(8)
    Phi = rng.standard_normal((6, 9))
    F = history(rng, 30, 6, 1.0)
    V = allocation(Phi, np.full(9, 1e3)).solve(F)
    np.testing.assert_allclose(V, F @ np.linalg.pinv(Phi).T, rtol=1e-12, atol=1e-13)
    np.testing.assert_allclose(allocation(Phi, np.full(9, np.inf)).solve(F), V, rtol=1e-11, atol=1e-13)


@pytest.mark.parametrize("Phi", [np.zeros((3, 4)), np.ones((3, 4)), np.outer([1e-9, 1.0, 1e9], np.arange(1.0, 5.0))])
def test_degenerate_patches_still_get_voltages(Phi):
    """Patches that do nothing, or all the same: some voltages within the limits, with the least residual there is."""
    limit = np.array([1.0, 2.0, 0.5, np.inf])
    F = np.array([[1.0, -2.0, 3.0], [1e6, 1e6, 1e6], [0.0, 0.0, 0.0]])
    V = allocation(Phi, limit).solve(F)
    assert np.all(np.isfinite(V))
    assert np.all(np.abs(V) <= limit)
    bounds = (-limit, limit)
    for f, v in zip(F, V, strict=True):
        best = lsq_linear(Phi, f, bounds, tol=1e-14)
        left, least = np.linalg.norm(f - Phi @ v), np.linalg.norm(f - Phi @ best.x)
        assert left <= least * (1 + 1e-9) + RIDGE * np.linalg.norm(f)


def test_round_off_does_not_scatter_voltages_that_are_hardly_unique():
    """With the same voltages at limits the others are linear in the force, or steps of any length err by the scatter.

    Weights of one point above all, more pairs than modes: A^T A has a condition number of 1e13 with its ridge.
    """
    rng = np.random.default_rng(9)
    Phi, limit = np.geomspace(1, 500, 8)[:, None] * rng.standard_normal((8, 12)), np.full(12, 0.7)
    W_sqrt = np.vstack([rng.standard_normal(8) / np.geomspace(1, 500, 8), 1e-2 * np.diag(1 / np.geomspace(1, 500, 8))])
    start, way = Phi @ rng.uniform(-0.9, 0.9, 12), Phi @ rng.uniform(-1e-4, 1e-4, 12)
    shares = np.linspace(0, 1, 41)
    V = allocation(Phi, limit, W_sqrt).solve(start + shares[:, None] * way)
    at_limit = np.abs(V) == limit
    assert at_limit[0].any()
    assert np.array_equal(at_limit, np.broadcast_to(at_limit[0], V.shape))
    np.testing.assert_allclose(V, V[0] + shares[:, None] * (V[-1] - V[0]), atol=1e-9)
