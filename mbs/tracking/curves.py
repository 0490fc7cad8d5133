"""Curves whose derivative of some order is linear between breaks: V itself, V̈ where gears give, ë of a path error."""

from __future__ import annotations

from itertools import product
from math import factorial

import numpy as np

from ...common.arrays import Array, Indices
from ...common.libraries import scipy
from ...common.structs import struct
from ..inversion.collocation import GAUSS


@struct
class Curves:
    """V(t) of m patches, or e(t), on intervals between `breaks` (N + 1,), s, with a linear derivative of `order`.

    On an interval V follows from that derivative at both ends, and from V and the lower derivatives where it begins.
    """

    breaks: Array
    order: int

    @property
    def within(self) -> Array:
        """Where limits of V or its rate act, as shares of an interval: where it is linear, at breaks alone."""
        return np.zeros(1) if self.order == 0 else np.append(0.0, GAUSS.c)

    def curve(self, u: Array) -> scipy.interpolate.PPoly:
        """V(t) by `u` (N + 1, m (order + 1)) at breaks: the linear derivative, then V and the lower ones."""
        linear, *lower = np.split(u, self.order + 1, axis=1)
        slope = np.diff(linear, axis=0) / (factorial(self.order + 1) * np.diff(self.breaks)[:, None])
        derivatives = [*lower, linear]
        powers = [derivatives[k][:-1] / factorial(k) for k in range(self.order, -1, -1)]
        return scipy.interpolate.PPoly(np.array([slope, *powers]), self.breaks)

    def parts(self, xi: Array, derivative: int = 0) -> Array:
        """A derivative of V at shares ξ (S,) of intervals, (N, S, order + 2), by what it follows from.

        These are the linear derivative at the beginning and the end of the interval, then V and the lower ones.
        """
        h, x, times = np.diff(self.breaks)[:, None], xi[None], self.order - derivative  # times it is integrated
        if times < 0:
            last = np.ones_like(x) / h
            first = -last
        else:
            last = h**times * x ** (times + 1) / factorial(times + 1)
            first = h**times * (x**times / factorial(times) - x ** (times + 1) / factorial(times + 1))
        one, by = np.ones_like(h * x), [first, last]
        for k in range(-derivative, self.order - derivative):
            by.append((h * x) ** k / factorial(k) if k >= 0 else 0.0 * one)
        return np.stack([one * of for of in by], axis=2)


@struct
class Unknowns:
    """Curves of `count` patches or coordinates among the `width` unknowns z of an interval.

    `places` (order + 2,) are those of what they follow from, in the order of `Curves.parts`.
    """

    curves: Curves
    count: int
    places: Indices
    width: int

    def by_z(self, xi: Array, derivative: int = 0) -> Array:
        """A derivative at shares ξ (S,) of intervals by z: (N, S, count, width)."""
        parts, each = self.curves.parts(xi, derivative), np.arange(self.count)
        by_z = np.zeros((*parts.shape[:2], self.count, self.width))
        for k, place in enumerate(self.places):
            by_z[:, :, each, place + each] = parts[:, :, k, None]
        return by_z

    def squares(self, weights: Array, derivative: int) -> Array:
        """Quadratic forms (N, width, width) of Σ weights |derivative|², with weights (N, 4) at the Gauss points."""
        parts, each = self.curves.parts(GAUSS.c, derivative), np.arange(self.count)
        squares = np.einsum("Ns,Nsa,Nsb->abN", weights, parts, parts)
        found = np.zeros((len(parts), self.width, self.width))
        for (i, first), (j, second) in product(enumerate(self.places), repeat=2):
            found[:, first + each, second + each] += squares[i, j][:, None]
        return found
