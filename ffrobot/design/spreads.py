"""Distributions of keys (`KEY=±2%`, `KEY=normal:SIGMA`, …), and statistics of linear functions of them.

The mean of a Latin hypercube is better the nearer its quantity is to a sum of functions of one key each (Stein,
Technometrics 29, 1987).
"""

import math
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Literal

import numpy as np
from scipy.special import ndtri

from ..common.arrays import Array
from ..common.errors import InputError
from ..common.libraries import scipy
from ..common.structs import struct
from ..common.tables import shown
from ..sweep.files import number_at
from ..sweep.sweep import Key
from .designs import parse_key

LEVELS = (0.05, 0.5, 0.95)
NAMES = tuple(f"{100 * level:g}%" for level in LEVELS)
RESAMPLES = 200  # of a bootstrap


@struct
class SpreadStatistics:
    """Statistics of quantities (…) in their units: `mean` (…), `deviation` (…), `quantiles` (3, …): 5, 50, 95 %.

    Standard errors of these have the same shapes. `lowest` and `highest` (…) are the worst cases: the least and the
    largest sample.
    """

    mean: Array
    mean_error: Array
    deviation: Array
    deviation_error: Array
    quantiles: Array
    quantile_errors: Array
    lowest: Array
    highest: Array

    @property
    def named(self) -> dict[str, tuple[Array, Array]]:
        """Mean, deviation and quantiles (…) by name, each with its standard error, in the unit of the quantity."""
        quantiles = dict(zip(NAMES, zip(self.quantiles, self.quantile_errors, strict=True), strict=True))
        return {"mean": (self.mean, self.mean_error), "deviation": (self.deviation, self.deviation_error), **quantiles}

    @property
    def columns(self) -> list[str]:
        """Column names of `numbers`."""
        return [*(f"{name}{error}" for name in self.named for error in ("", "_error")), "lowest", "highest"]

    def numbers(self, k: int) -> list[float]:
        """Return the statistics of quantity k in the order of `columns`."""
        values = [value for pair in self.named.values() for value in pair]
        return [float(one[k]) for one in (*values, self.lowest, self.highest)]


def statistics(values: Array) -> SpreadStatistics:
    """Return statistics of n > 1 samples `values` (n, …), in their unit.

    Errors are those of independent samples: of the deviation by the fourth central moment, of quantiles by order
    statistics.
    """
    n = len(values)
    mean, s = values.mean(axis=0), values.std(axis=0, ddof=1)
    fourth = np.mean((values - mean) ** 4, axis=0)
    spread = np.sqrt(np.maximum(0.0, fourth - s**4 * (n - 3) / (n - 1)) / n)
    p = np.array(LEVELS)
    step = np.sqrt(p * (1.0 - p) / n)
    low, high = (np.quantile(values, np.clip(p + sign * step, 0.0, 1.0), axis=0) for sign in (-1.0, 1.0))
    return SpreadStatistics(
        mean=mean,
        mean_error=s / np.sqrt(n),
        deviation=s,
        deviation_error=np.divide(spread, 2.0 * s, out=np.zeros_like(s), where=s > 0.0),
        quantiles=np.quantile(values, p, axis=0),
        quantile_errors=0.5 * (high - low),
        lowest=values.min(axis=0),
        highest=values.max(axis=0),
    )


def regression_shares(inputs: Array, outputs: Array) -> tuple[Array, Array]:
    """Return squared standardized regression coefficients (g, k) and R² (g,), no unit.

    `outputs` (n, g) and `inputs` (n, k), any unit: n samples of g responses and k keys. Near R² = 1 coefficients are
    shares of the variance; else the responses are not linear.
    """
    x = (inputs - inputs.mean(axis=0)) / inputs.std(axis=0)
    size = outputs.std(axis=0)
    y = (outputs - outputs.mean(axis=0)) / np.where(size > 0.0, size, 1.0)
    coefficients, *_ = np.linalg.lstsq(x, y, rcond=None)
    residual = y - x @ coefficients
    explained = np.where(size > 0.0, 1.0 - np.mean(residual**2, axis=0), np.nan)
    return coefficients.T**2, explained


@struct
class Indices:
    """Sobol indices (g, k), no unit, of g responses by k keys: `first` order (a key alone), `total` (interactions too).

    Errors (g, k) are those of the bootstrap.
    """

    first: Array
    first_error: Array
    total: Array
    total_error: Array

    @property
    def named(self) -> dict[str, tuple[Array, Array]]:
        """Indices (g, k) with errors (g, k), no unit, as "alone" (first order) and "with others" (total)."""
        return {"alone": (self.first, self.first_error), "with others": (self.total, self.total_error)}


def sobol_indices(a: Array, b: Array, ab: Array, seed: int = 0) -> Indices:
    """Return Sobol indices from g responses, any unit, at points A (n, g), B (n, g), A with column i of B (k, n, g).

    First order after Saltelli et al. (Computer Physics Communications 181, 2010, table 2b), total after Jansen
    (Computer Physics Communications 117, 1999).
    """
    whole = np.isfinite(a).all(axis=1) & np.isfinite(b).all(axis=1) & np.isfinite(ab).all(axis=(0, 2))
    a, b, ab = a[whole], b[whole], ab[:, whole]
    first, total = _indices(a, b, ab)
    rng = np.random.default_rng(seed)
    draws = [rng.integers(0, len(a), len(a)) for _ in range(RESAMPLES)]
    again = [_indices(a[rows], b[rows], ab[:, rows]) for rows in draws]
    errors = [np.std([one[m] for one in again], axis=0) for m in (0, 1)]
    return Indices(first, errors[0], total, errors[1])


def _indices(a: Array, b: Array, ab: Array) -> tuple[Array, Array]:
    centre = np.concatenate([a, b]).mean(axis=0)  # smaller products, smaller errors
    variance = np.concatenate([a, b]).var(axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        first = np.mean((b - centre) * (ab - a), axis=1) / variance
        total = 0.5 * np.mean((a - ab) ** 2, axis=1) / variance
    return first.T, total.T


WIDE = 2.0  # standard deviations of a normal key within which scenes have to be valid


@struct
class Spread:
    """Distribution of one key: uniform within `half` of `mean`, or normal with the standard deviation `deviation`.

    `text` is what the user wrote, `own` the value of the scene; numbers are in the unit of the key.
    """

    key: Key
    text: str
    own: float
    kind: Literal["uniform", "normal"]
    mean: float
    deviation: float

    @property
    def half(self) -> float:
        """Half width of a uniform distribution, in the unit of the key: √3 `deviation`."""
        return math.sqrt(3.0) * self.deviation

    @property
    def ends(self) -> tuple[float, float]:
        """Values of the key, in its unit, between which scenes must be valid; if normal, `mean` ± 2 `deviation`."""
        far = self.half if self.kind == "uniform" else WIDE * self.deviation
        return self.mean - far, self.mean + far

    def values(self, u: Array) -> Array:
        """Return values (n,) of the key, in its unit, at probabilities u (n,) in (0, 1)."""
        if self.kind == "uniform":
            return self.mean + self.half * (2.0 * u - 1.0)
        return self.mean + self.deviation * ndtri(u)


def parse_spread(text: str, path: Path) -> Spread:
    """Return the distribution that `text` gives a key of the scene file at `path`. Raises `InputError`."""
    name, equals, values = text.partition("=")
    key = parse_key(name, "--spread")
    own = number_at(path, key, "--spread")
    word, *numbers = values.strip().split(":")
    for sign in ("±", "+-", "+/-"):
        if word.startswith(sign):
            word, numbers = "±", [word.removeprefix(sign), *numbers]
    with suppress(ValueError):
        match word, numbers:
            case "±", [half] if equals:
                return Spread(key, text, own, "uniform", own, _size(half, own, text) / math.sqrt(3.0))
            case "normal", [sigma]:
                return Spread(key, text, own, "normal", own, _size(sigma, own, text))
            case "uniform", [low, high]:
                a, b = float(low), float(high)
                if -math.inf < a < b < math.inf:
                    return Spread(key, text, own, "uniform", (a + b) / 2.0, (b - a) / math.sqrt(12.0))
    raise InputError(
        "--spread: expected KEY=±2%, KEY=±0.1, KEY=uniform:LOW:HIGH, KEY=normal:SIGMA or KEY=normal:2%, with positive"
        " spreads",
        f'"{shown(text)}"',
    )


def _size(text: str, own: float, whole: str) -> float:
    """A positive number, or so many percent of the key's value. Raises `ValueError` for what is neither."""
    percent = text.strip().endswith("%")
    value = float(text.strip().removesuffix("%"))
    if percent and own == 0.0:
        raise InputError("--spread: expected a spread in the unit of a key whose value is 0", f'"{shown(whole)}"')
    size = value / 100.0 * abs(own) if percent else value
    if not 0.0 < size < math.inf:
        raise ValueError
    return size


DRAWS = 4096  # of the model, for quantiles: no runs


def linear_statistics(spreads: Sequence[Spread], middle: Array, sides: Array) -> tuple[SpreadStatistics, Array]:
    """Return statistics of linear functions of k keys, and shares (…, k), no unit, of the variance by each key.

    `middle` (…): responses, any unit, with all keys at their means; `sides` (k, 2, …): with one key a standard
    deviation above and below. Errors: changes of the statistics by curvatures. Worst cases have every key at an end of
    its spread, a normal one two deviations off.
    """
    above, below = sides[:, 0], sides[:, 1]
    slopes, curvatures = 0.5 * (above - below), above - 2.0 * middle + below
    u = scipy.stats.qmc.LatinHypercube(len(spreads), seed=0).random(DRAWS)
    delta = np.column_stack([(one.values(u[:, k]) - one.mean) / one.deviation for k, one in enumerate(spreads)])
    linear = middle + np.tensordot(delta, slopes, 1)
    bent = linear + 0.5 * np.tensordot(delta**2, curvatures, 1)
    quantiles, squares = np.quantile(linear, LEVELS, axis=0), slopes**2
    variance = squares.sum(axis=0)
    reach = np.tensordot([(one.ends[1] - one.mean) / one.deviation for one in spreads], np.abs(slopes), 1)
    found = SpreadStatistics(
        mean=middle,
        mean_error=np.abs(bent.mean(axis=0) - linear.mean(axis=0)),
        deviation=np.sqrt(variance),
        deviation_error=np.abs(bent.std(axis=0) - linear.std(axis=0)),
        quantiles=quantiles,
        quantile_errors=np.abs(np.quantile(bent, LEVELS, axis=0) - quantiles),
        lowest=middle - reach,
        highest=middle + reach,
    )
    return found, np.divide(squares, variance, out=np.zeros_like(squares), where=variance > 0.0).T
