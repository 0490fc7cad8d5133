"""Extrapolated differences: weights of Richardson, order, what the estimate of the error is worth."""

from itertools import pairwise

import numpy as np
import pytest

from ffrobot.design.derivatives import derivative, weights

LADDER = np.array([1.0, 0.5, 0.25])
CENTRAL = np.concatenate([[0.0], LADDER, -LADDER])


def function(x):
    return np.exp(np.sin(3.0 * x)) + x**2


TRUE = 3.0


def test_weights_are_those_of_richardson():
    """Romberg's table of central differences with h, h/2, h/4, written out."""

    def central(h, f):
        return (f(h) - f(-h)) / (2 * h)

    first = [central(h, function) for h in (0.4, 0.2, 0.1)]
    second = [(4 * fine - coarse) / 3 for coarse, fine in pairwise(first)]
    expected = (16 * second[1] - second[0]) / 15
    x = 0.4 * CENTRAL
    assert weights(x) @ function(x) == pytest.approx(expected, rel=1e-13)


@pytest.mark.parametrize(("offsets", "order"), [(CENTRAL, 6), (CENTRAL[:4], 3)])
def test_order(offsets, order):
    """Both sides: h⁶; one side, with the value itself: h³."""
    errors = [abs(derivative(h * offsets, function(h * offsets)).value - TRUE) for h in (0.16, 0.08)]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.5)


@pytest.mark.parametrize("h", [0.2, 0.05, 0.01, 1e-4])
def test_the_estimate_is_no_less_than_the_error(h):
    x = h * CENTRAL
    found = derivative(x, function(x))
    assert abs(found.value - TRUE) <= found.error


@pytest.mark.parametrize("noise", [1e-10, 1e-7])
def test_noise_shows_in_the_estimate(noise):
    """Of forty signals with noise, nine in ten are off by less than three estimates."""
    rng = np.random.default_rng(7)
    x = 0.01 * CENTRAL
    within = 0
    for _ in range(40):
        found = derivative(x, function(x) + noise * rng.uniform(-1, 1, x.size))
        within += abs(found.value - TRUE) <= 3 * found.error
    assert within >= 36


def test_failed_runs_are_left_out():
    values = function(0.1 * CENTRAL)
    values[1] = np.nan  # the largest step to one side
    assert derivative(0.1 * CENTRAL, values).value == pytest.approx(TRUE, rel=1e-4)
    values[4:] = np.nan  # the other side
    assert derivative(0.1 * CENTRAL, values).value == pytest.approx(TRUE, rel=1e-2)
    values[2:] = np.nan  # nothing is left but the value itself
    assert np.isnan(derivative(0.1 * CENTRAL, values).value)
