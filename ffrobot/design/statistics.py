"""Mean, standard deviation and quantiles of samples with their own errors, and what shares of a variance keys have.

Errors are those of independent samples. The mean of a Latin hypercube, whose samples are spread evenly over every key,
is better the nearer its quantity is to a sum of functions of one key each (Stein, Technometrics 29, 1987).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..common.arrays import Array, as_floats

LEVELS = (0.05, 0.5, 0.95)
RESAMPLES = 200  # of a bootstrap


@dataclass(frozen=True)
class Statistics:
    """Of quantities of any shape (…): `mean` (…), `deviation` (…), `quantiles` (3, …) at `LEVELS`.

    Beside each its standard error: `mean_error`, `deviation_error`, `quantile_errors`. `lowest` and `highest` (…) are
    the worst case: of samples the least and the largest one.
    """

    mean: Array
    mean_error: Array
    deviation: Array
    deviation_error: Array
    quantiles: Array
    quantile_errors: Array
    lowest: Array
    highest: Array


def statistics(values: Array) -> Statistics:
    """Of samples (n, …), n > 1.

    The error of s is √((m₄ − s⁴ (n − 3)/(n − 1))/n)/2s with the fourth central moment m₄; that of a quantile half the
    distance between the order statistics one standard deviation of the binomial distribution below and above it.
    """
    n = len(values)
    mean, s = values.mean(axis=0), values.std(axis=0, ddof=1)
    fourth = np.mean((values - mean) ** 4, axis=0)
    spread = np.sqrt(np.maximum(0.0, fourth - s**4 * (n - 3) / (n - 1)) / n)
    deviation_error = np.divide(spread, 2.0 * s, out=np.zeros_like(s), where=s > 0.0)
    p = np.array(LEVELS)
    step = np.sqrt(p * (1.0 - p) / n)
    low, high = (np.quantile(values, np.clip(p + sign * step, 0.0, 1.0), axis=0) for sign in (-1.0, 1.0))
    quantiles = np.quantile(values, p, axis=0)
    errors = as_floats(0.5 * (high - low))
    least, largest = values.min(axis=0), values.max(axis=0)
    return Statistics(mean, s / np.sqrt(n), s, deviation_error, quantiles, errors, least, largest)


def regression_shares(inputs: Array, outputs: Array) -> tuple[Array, Array]:
    """Squared standardised regression coefficients (g, k) of outputs (n, g) by inputs (n, k), and R² (g,).

    Where R² is near one, coefficients are shares of the variance; where it is not, the goals are not linear.
    """
    x = (inputs - inputs.mean(axis=0)) / inputs.std(axis=0)
    size = outputs.std(axis=0)
    y = (outputs - outputs.mean(axis=0)) / np.where(size > 0.0, size, 1.0)
    coefficients, *_ = np.linalg.lstsq(x, y, rcond=None)
    residual = y - x @ coefficients
    explained = np.where(size > 0.0, 1.0 - np.mean(residual**2, axis=0), np.nan)
    return as_floats(coefficients.T**2), as_floats(explained)


@dataclass(frozen=True)
class Indices:
    """Sobol indices (g, k) with bootstrap errors: `first`, what a key does alone, and `total`, with all others."""

    first: Array
    first_error: Array
    total: Array
    total_error: Array


def sobol_indices(a: Array, b: Array, ab: Array, seed: int = 0) -> Indices:
    """Of goals at points A (n, g), B (n, g), and A with column i from B (k, n, g).

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
    return as_floats(first.T), as_floats(total.T)
