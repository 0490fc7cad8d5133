"""Gauss collocation of second-order boundary value problems against solutions that are known."""

import numpy as np
import pytest

from ffrobot.mbs.solve.collocation import Boundary, Problem, collocate

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
        return one, 0 * one, -np.diag(SIGMA**2) * one

    rest = np.zeros(4)
    no_decaying, no_growing = (np.hstack([-sign * np.diag(SIGMA), np.eye(2)]) for sign in (1, -1))
    return Problem(residual, derivatives, SIGMA, 1.0, Boundary(no_decaying, rest), Boundary(no_growing, rest))


def zero(t):
    return (np.zeros((len(t), 2)),) * 3


def error_at_breaks(intervals):
    breaks = np.linspace(0, 2, intervals + 1)
    found = collocate(dichotomy(), breaks, zero)
    assert found.converged
    return np.abs(found.curve(breaks) - bell(breaks)[0]).max(axis=0)


def test_order_at_the_breaks_is_twice_the_number_of_points():
    """Superconvergence h⁸ of four Gauss points, where intervals resolve the motion (Ascher et al. 1995, ch. 5)."""
    errors = [error_at_breaks(n)[0] for n in (20, 40)]
    assert np.log2(errors[0] / errors[1]) > 7.0


def test_intervals_need_not_resolve_fast_growing_and_decaying_motions():
    """σh = 1000 in the second component: forward integration would grow by e^40000."""
    assert error_at_breaks(40)[1] < 1e-4


def vibration(omega, zeta, state, breaks):
    """p̈ + 2ζω ṗ + ω² p = 0 from (p, ṗ) at the first break: both at the last."""
    one = np.array([omega])
    problem = Problem(
        lambda t, p, v, a: a + 2 * zeta * omega * v + omega**2 * p,
        lambda t: (np.full((len(t), 1, 1), x) for x in (1.0, 2 * zeta * omega, omega**2)),
        one,
        omega,
        Boundary(np.eye(2), np.array(state)),
        Boundary(np.zeros((0, 2)), np.zeros(2)),
    )
    found = collocate(problem, breaks, lambda t: (np.zeros((len(t), 1)),) * 3)
    assert found.converged
    return found.curve(breaks[-1])[0], found.curve.derivative()(breaks[-1])[0]


def pade(z):
    """The diagonal Padé approximant (4, 4) of e^z, by which a step of Gauss's method multiplies solutions of ẏ = λy."""
    P = np.polynomial.Polynomial([1, 1 / 2, 3 / 28, 1 / 84, 1 / 1680])
    return P(z) / P(-z)


@pytest.mark.parametrize("zeta", [-0.01, 0.0, 0.01])
def test_vibrations_grow_or_decay_as_they_do_however_long_the_interval(zeta):
    """The sides of all zeros stay: |multiplier| < 1 for damped ones, 1 for undamped ones, > 1 for growing ones."""
    for omega in np.geomspace(0.1, 1e4, 60):
        columns = [vibration(omega, zeta, [p, omega * v], np.array([0.0, 1.0])) for p, v in np.eye(2)]
        size = np.abs(np.linalg.eigvals(np.array(columns).T / np.array([[1.0], [omega]])))
        s = omega * (-zeta + 1j * np.sqrt(1 - zeta**2))
        np.testing.assert_allclose(size, abs(pade(s)), rtol=1e-7)
        assert np.all(np.sign(np.round(size - 1, 10)) == np.sign(-zeta))
