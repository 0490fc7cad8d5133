"""Screening by elementary effects (Morris, Technometrics 33, 1991): which of many keys matter, in few runs.

A trajectory begins at a point of a grid with an even number of levels in the unit cube and changes one key after the
other, each once, by Δ = levels / (2 (levels − 1)): k + 1 points give an elementary effect δf/δu of each of k keys. Of
r trajectories μ is the mean of a key's effects, σ their standard deviation, and μ* the mean of their sizes, which does
not cancel (Campolongo, Cariboni & Saltelli, Environmental Modelling & Software 22, 2007). Of a linear function μ* is
the change of f over the whole range of the key, and σ is 0; where σ is as large as μ*, the key bends f, or acts with
others.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..common.arrays import Array, Integers, as_floats

LEVELS = 4


@dataclass(frozen=True)
class Trajectories:
    """r trajectories: `points` (r, k + 1, k) in the unit cube, and the key that each step changes, `order` (r, k)."""

    points: Array
    order: Integers


@dataclass(frozen=True)
class Effects:
    """Of g goals by k keys, in units of the goals: `mu`, `mu_star`, its standard error and `sigma`, all (g, k).

    `count` (g, k) of effects that they are made from; NaN where there is none, of σ and errors where there is one.
    """

    mu: Array
    mu_star: Array
    mu_star_error: Array
    sigma: Array
    count: Integers


def draw_trajectories(keys: int, count: int, seed: int, levels: int = LEVELS) -> Trajectories:
    """So many of them; a Latin hypercube has them begin at all levels of every key alike."""
    from scipy.stats.qmc import LatinHypercube

    start = np.floor(levels * LatinHypercube(keys, seed=seed).random(count)).astype(int)
    step = np.where(start < levels // 2, levels // 2, -(levels // 2))  # from the lower half up, else down
    order = np.random.default_rng(seed).permuted(np.tile(np.arange(keys), (count, 1)), axis=1)
    turn = np.argsort(order, axis=1)  # (r, k) when each key is changed
    changed = np.arange(keys + 1)[None, :, None] > turn[:, None, :]
    points = (start[:, None, :] + changed * step[:, None, :]) / (levels - 1)
    return Trajectories(as_floats(points), order)


def elementary_effects(taken: Trajectories, values: Array) -> Effects:
    """By the goals at all points, `values` (r, k + 1, g); a NaN, of a run that failed, costs the effects beside it."""
    rows = np.arange(len(taken.order))[:, None]
    steps = np.diff(taken.points, axis=1)[rows, np.arange(taken.order.shape[1]), taken.order]  # (r, k) in turn
    effects = np.empty_like(values[:, 1:])  # (r, k, g)
    effects[rows, taken.order] = np.diff(values, axis=1) / steps[:, :, None]
    known = np.isfinite(effects)
    count = known.sum(axis=0)
    mu, sigma = _moments(effects, known)
    mu_star, size_sigma = _moments(np.abs(effects), known)
    with np.errstate(divide="ignore", invalid="ignore"):
        error = size_sigma / np.sqrt(count)
    return Effects(mu.T, mu_star.T, as_floats(error.T), sigma.T, count.T)


def _moments(effects: Array, known: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Mean and standard deviation (k, g) of those that are known."""
    count = known.sum(axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        mean = np.where(known, effects, 0.0).sum(axis=0) / count
        squares = np.where(known, (effects - mean) ** 2, 0.0).sum(axis=0)
        return as_floats(mean), as_floats(np.sqrt(squares / np.where(count > 1, count - 1, np.nan)))
