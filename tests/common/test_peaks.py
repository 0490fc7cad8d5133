"""Largest values between samples and root mean squares, against closed forms."""

import numpy as np
import pytest

from ffrobot.common.peaks import largest, root_mean_square


@pytest.mark.parametrize("samples_per_period", [12, 25, 60])
def test_the_top_of_a_sine_lies_between_its_samples(samples_per_period):
    time = np.arange(0.0, 2.0, 1.0 / samples_per_period)
    peak, at = largest(time, -3.0 * np.sin(2 * np.pi * (time - 0.123)))
    error = (2 * np.pi / samples_per_period) ** 5 / 100  # of degree 4
    assert peak == pytest.approx(3.0, rel=error)
    assert abs((at - 0.123) % 0.5 - 0.25) < 10 * error


@pytest.mark.parametrize(("count", "error"), [(20, 5e-6), (10, 3e-4), (8, 1.1e-3)])
def test_errors_of_vibrations_by_samples_in_a_period(count, error):
    """Wherever its samples are."""
    for shift in np.linspace(0.0, 1.0, 41):
        time = 2 * np.pi / count * (np.arange(-count, count + 1) + shift)
        assert abs(largest(time, np.cos(time) * np.exp(-1e-3 * time**2))[0] - 1.0) < error


@pytest.mark.parametrize("values", [[0, 1, 1, 1, 0, 0, 0], [0, 0, 3, 2, 1, 0, 0], [0, 1, 2, 3, -3, -2, -1]])
def test_a_jump_is_no_smooth_top(values):
    assert largest(np.arange(7.0), np.array(values, dtype=float))[0] == np.abs(values).max()


def test_root_mean_square_is_over_time():
    """Of t over [0, 1], with samples that crowd at one end: 1/√3."""
    time = np.linspace(0.0, 1.0, 2001) ** 3
    assert root_mean_square(time, time) == pytest.approx(1 / np.sqrt(3), rel=1e-6)
