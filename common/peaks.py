"""Largest values and root mean squares of what is known at some times, between these times too."""

from collections.abc import Callable

import numpy as np

from .arrays import Array, Indices

ALIKE = 4.0  # ratio of curvatures about a value within which it is the top of something smooth


def largest(time: Array, values: Array) -> tuple[float, float]:
    """Return the largest |value| of `values` (T,), in their unit, and its time (s), from `time` (T,), s.

    A smooth top is that of the polynomial of degree 4 through five values; next to jumps and ends it is the largest
    value itself. Without values 0 and NaN.
    """
    return top_at(time, values, int(np.abs(values).argmax())) if len(values) else (0.0, float("nan"))


def largest_below(bounds: Array, largest_of: Callable[[Indices], float]) -> float:
    """The largest of values below `bounds` (T,), any unit, by `largest_of` those that may be it; 0 of none."""
    if not len(bounds):
        return 0.0
    known = largest_of(bounds.argmax(keepdims=True))
    return max(known, largest_of(np.flatnonzero(bounds > known)))


def top_at(time: Array, values: Array, k: int) -> tuple[float, float]:
    """Size and time (s) of the maximum of |values| (T,), any unit, next to values[k]; `time` (T,), s: see `largest`."""
    peak, at = float(abs(values[k])), float(time[k])
    if not 2 <= k < len(values) - 2:
        return peak, at
    t, x = time[k - 2 : k + 3] - at, np.sign(values[k]) * values[k - 2 : k + 3]
    slopes = np.diff(x) / np.diff(t)
    curvatures = -np.diff(slopes) / (t[2:] - t[:-2])
    if not 0.0 < curvatures.max() <= ALIKE * curvatures.min():
        return peak, at
    width = t[4] - t[0]
    curve = np.polyfit(t / width, x, 4)
    tops = np.roots(np.polyder(curve))
    tops = tops[np.isreal(tops)].real * width
    inside = tops[(tops > t[1]) & (tops < t[3])]
    heights = np.polyval(curve, inside / width)
    best = int(heights.argmax()) if inside.size else -1
    return (float(heights[best]), at + float(inside[best])) if best >= 0 and heights[best] > peak else (peak, at)


def shares(time: Array) -> Array:
    """Weights (T,), of sum 1, of values at `time` (T,), s, in a mean over time by the trapezoidal rule."""
    if len(time) < 2:
        return np.ones(len(time))
    steps = np.diff(time)
    return (np.append(steps, 0.0) + np.append(0.0, steps)) / (2 * (time[-1] - time[0]))


def root_mean_square(time: Array, values: Array) -> float:
    """The root mean square of `values` (T,), in their unit, over `time` (T,), s; 0 of none."""
    return float(np.sqrt(shares(time) @ values**2)) if len(values) else 0.0
