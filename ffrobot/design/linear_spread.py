"""Statistics of a quantity that is linear in keys that are spread, with the error that curvature makes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..common.arrays import Array, as_floats
from .spreads import Spread
from .statistics import LEVELS, Statistics

DRAWS = 4096  # of the model, for quantiles: no runs


@dataclass(frozen=True)
class LinearModel:
    """f = f₀ + Σ d_k δ_k + ½ Σ c_k δ_k² with δ_k in standard deviations of key k.

    `middle` (…), `slopes` (k, …) and `curvatures` (k, …); the last are for errors alone.
    """

    spreads: tuple[Spread, ...]
    middle: Array
    slopes: Array
    curvatures: Array

    @staticmethod
    def through(spreads: Sequence[Spread], middle: Array, sides: Array) -> LinearModel:
        """By values `sides` (k, 2, …) one standard deviation above and below the middle."""
        above, below = sides[:, 0], sides[:, 1]
        return LinearModel(tuple(spreads), middle, 0.5 * (above - below), above - 2.0 * middle + below)

    @property
    def shares(self) -> Array:
        """(…, k) of the variance."""
        squares = self.slopes**2
        whole = squares.sum(axis=0)
        return as_floats(np.divide(squares, whole, out=np.zeros_like(squares), where=whole > 0.0).T)

    def statistics(self) -> Statistics:
        """Of the linear part; errors are the differences that the curvatures make.

        The worst case has every key at the end of its spread that makes it worst, a normal one two deviations off.
        """
        from scipy.stats.qmc import LatinHypercube

        u = LatinHypercube(len(self.spreads), seed=0).random(DRAWS)
        delta = np.column_stack(
            [(one.values(u[:, k]) - one.mean) / one.deviation for k, one in enumerate(self.spreads)]
        )
        linear = self.middle + np.tensordot(delta, self.slopes, 1)
        bent = linear + 0.5 * np.tensordot(delta**2, self.curvatures, 1)
        quantiles = np.quantile(linear, LEVELS, axis=0)
        deviation = np.sqrt((self.slopes**2).sum(axis=0))
        ends = np.array([(one.ends[1] - one.mean) / one.deviation for one in self.spreads])
        reach = np.tensordot(ends, np.abs(self.slopes), 1)
        return Statistics(
            self.middle, as_floats(np.abs(bent.mean(axis=0) - linear.mean(axis=0))),
            as_floats(deviation), as_floats(np.abs(bent.std(axis=0) - linear.std(axis=0))),
            as_floats(quantiles), as_floats(np.abs(np.quantile(bent, LEVELS, axis=0) - quantiles)),
            as_floats(self.middle - reach), as_floats(self.middle + reach),
        )  # fmt: skip
