"""Paths as machines run them: laws of motion, limits, legs with holds, shapers."""

from math import inf

import numpy as np
import pytest

from ffrobot.mbs.fields.paths import (
    RESIDUAL,
    Legs,
    PathLimits,
    Piecewise,
    impulses,
    law_in,
    law_within,
    path_of,
)

LAWS = [("rest-to-rest", 2), ("rest-to-rest", 4), ("s-curve", 2), ("s-curve", 4), ("trapezoid", 1)]


def legs(places, **keys):
    count = len(places) - 1
    given = {"start": 0.0, "profile": "s-curve", "smoothness": 2, "limits": PathLimits(), "durations": (1.0,) * count}
    return Legs(np.array(places, dtype=float), **(given | {"holds": (0.0,) * (count - 1)} | keys))


def over(motion, count=2001, beyond=0.0):
    return np.linspace(motion.begin - beyond, motion.end + beyond, count)


@pytest.mark.parametrize(("profile", "smoothness"), LAWS)
def test_law_goes_from_0_to_1_with_as_many_continuous_derivatives(profile, smoothness):
    law = law_in(0.7, profile, smoothness)
    assert (law.begin, law.end) == (0.0, pytest.approx(0.7, rel=1e-14))
    assert (float(law.first[0]), float(law.last[0])) == (0.0, pytest.approx(1.0, abs=1e-13))
    for order in range(smoothness + 1):
        # Left of each break against right of it, in units of the largest value of that derivative.
        size = np.abs(law.sample(over(law), order)).max()
        outer = np.concatenate([[0.0], law.sample(law.breaks[1:-1], order)[:, 0], [float(order == 0)]])
        before = [_left(law, k, order) for k in range(len(law.breaks))]
        np.testing.assert_allclose(before, outer, atol=1e-11 * size)
    assert abs(_left(law, len(law.breaks) - 1, smoothness + 1)) > 1.0  # the next one jumps


def _left(law, k, order):
    if k == 0:
        return 0.0
    piece = Piecewise(law.breaks[k - 1 : k + 1], law.coefficients[k - 1 : k])
    powers = np.polyder(piece.coefficients[0, :, 0], order)
    return float(np.polyval(powers, law.breaks[k] - law.breaks[k - 1]))


@pytest.mark.parametrize(("profile", "smoothness"), LAWS)
@pytest.mark.parametrize("distance", [1e-4, 0.03, 0.5, 7.0])
def test_limits_are_kept_and_one_is_reached(profile, smoothness, distance):
    limits = PathLimits(1.5, 6.0, inf if profile == "trapezoid" else 50.0)
    law = law_within(distance, limits, profile, smoothness).along(np.array([distance]))
    ratios = [np.abs(law.sample(over(law, 20001), k)).max() / limit for k, limit in enumerate(limits, 1)]
    assert max(ratios) == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize(
    ("distance", "duration"),
    [  # h/v + v/a + a/j; a not reached: h/v + 2√(v/j); v not reached; neither: 4 (h/2j)^⅓
        (7.0, 7.0 / 1.5 + 1.5 / 6.0 + 6.0 / 50.0),
        (0.02, 4 * (0.02 / 100.0) ** (1 / 3)),
        (0.3, 6.0 / 50.0 + np.sqrt((6.0 / 50.0) ** 2 + 4 * 0.3 / 6.0)),
    ],
)
def test_s_curve_takes_the_time_of_the_textbook(distance, duration):
    """Biagiotti and Melchiorri 2008, sec. 3.4."""
    assert law_within(distance, PathLimits(1.5, 6.0, 50.0), "s-curve", 2).end == pytest.approx(duration, rel=1e-12)


def test_path_stops_at_its_places_and_holds_there():
    motion = path_of(legs([[0, 0], [1, 0], [1, 2]], start=0.2, durations=(1.0, 2.0), holds=(0.5,)))
    assert (motion.begin, motion.end) == (pytest.approx(0.2), pytest.approx(3.7))
    t = np.array([0.0, 0.2, 1.2, 1.45, 1.7, 3.7, 9.0])
    expected = [[0, 0], [0, 0], [1, 0], [1, 0], [1, 0], [1, 2], [1, 2]]
    np.testing.assert_allclose(motion.sample(t), expected, atol=1e-13)
    for order in (1, 2):
        np.testing.assert_allclose(motion.sample(t, order), 0.0, atol=1e-10)
    along = motion.sample(over(motion))
    assert along.min() > -1e-13  # nothing overshoots
    assert (along.max(axis=0) < [1 + 1e-13, 2 + 1e-13]).all()
    functions = motion.functions()
    t = over(motion, 301, beyond=0.5)
    for k, function in enumerate(functions):
        np.testing.assert_allclose(function.sample(t)[0], motion.sample(t)[:, k], atol=1e-13)


def test_blended_corner_stays_within_its_triangle_and_the_limits():
    limits, places = PathLimits(1.0, 4.0, 40.0), [[0, 0], [1, 0], [1, 1]]
    stopping, passing = (path_of(legs(places, limits=limits, durations=None, blend=blend)) for blend in (0.0, 0.4))
    assert passing.end < stopping.end
    x, y = passing.sample(over(passing, 4001)).T
    assert (y >= -1e-13).all()
    assert (x <= 1 + 1e-13).all()
    assert (y <= x + 1e-13).all()
    speed = np.linalg.norm(passing.sample(over(passing, 4001), 1), axis=1)
    assert speed[1300:2700].min() > 0.2  # no stop at the corner
    peaks = [np.linalg.norm(passing.sample(over(passing, 20001), k), axis=1).max() for k in (1, 2, 3)]
    ratios = np.array(peaks) / limits
    assert ratios.max() == pytest.approx(1.0, abs=1e-3)  # found by sampling


def residual(sequence, frequency, damping_ratio):
    """Amplitude after the last impulse, of that after a single one then (Singer and Seering 1990, Eq. 3)."""
    omega = 2 * np.pi * frequency
    decay, turn = damping_ratio * omega, omega * np.sqrt(1 - damping_ratio**2)
    last = sequence[-1].delay
    return abs(sum(i.share * np.exp((decay - 1j * turn) * (i.delay - last)) for i in sequence)) / np.exp(-decay * last)


@pytest.mark.parametrize("damping_ratio", [0.0, 0.02, 0.2])
def test_shapers_cancel_their_frequency(damping_ratio):
    zv, zvd, ei = (impulses(kind, 3.0, damping_ratio) for kind in ("zv", "zvd", "ei"))
    for sequence in (zv, zvd, ei):
        assert sum(i.share for i in sequence) == pytest.approx(1.0, rel=1e-15)
    assert residual(zv, 3.0, damping_ratio) < 1e-14
    assert residual(zvd, 3.0, damping_ratio) < 1e-14
    if damping_ratio == 0.0:
        assert residual(ei, 3.0, 0.0) == pytest.approx(RESIDUAL, rel=1e-12)


def test_wrong_frequencies_matter_less_to_zvd_and_ei():
    """Undamped: |cos(π f/2f₀)|, its square, and the width for 5 %: 0.06, 0.29, 0.40 (Singhose 1994, table 1)."""
    f = np.linspace(0.5, 1.5, 2001)
    zv, zvd, ei = (np.array([residual(impulses(kind, 1.0, 0.0), x, 0.0) for x in f]) for kind in ("zv", "zvd", "ei"))
    np.testing.assert_allclose(zv, np.abs(np.cos(np.pi * f / 2)), atol=1e-12)
    np.testing.assert_allclose(zvd, zv**2, atol=1e-12)
    widths = [np.ptp(f[v <= RESIDUAL + 1e-9]) for v in (zv, zvd, ei)]
    assert widths == pytest.approx([0.064, 0.286, 0.398], abs=0.002)
