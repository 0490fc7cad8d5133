"""How sure results are where keys are spread: `ffrobot uncertainty`, by samples or by gradients.

Samples are a Latin hypercube of the keys' distributions. With `indices` they are two of half the size, A and B, and for
every key A with that column from B: Sobol indices need no other runs. Gradients take two runs for each key, one
standard deviation to both sides; what these say of curvature is the estimate of the error.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..common.arrays import Array, as_floats
from ..common.errors import InputError, SolveError
from .designs import Design, Point, Runs
from .goals import parse_goal
from .readings import Goal, History, read_history
from .spreads import (
    Indices,
    LinearModel,
    SpreadDesigns,
    Statistics,
    read_spreads,
    regression_shares,
    sobol_indices,
    spread_points,
    statistics,
)
from .uncertainty_record import Band, LinearOrSampled, Uncertainty

TOLERANCE = 1e-8  # of runs for gradients, at most: differences of one standard deviation
FEWEST = 8  # samples for a quantile of 5 %


@dataclass(frozen=True)
class Curve(Goal):
    """A history as a whole."""

    text: str
    name: str

    def history(self, results_of: Design) -> History:
        """Of one column."""
        with results_of.results() as results:
            found = read_history(results, self.text, "--of")
        if found.values.shape[1] > 1:
            count = found.values.shape[1]
            raise InputError(f'--of: expected one column, such as "{self.text}[0]", found {count} of "{self.text}"')
        return found


def find_uncertainty(
    runs: Runs, of: Sequence[str], spread: Sequence[str], samples: int, seed: int, by: LinearOrSampled, *, indices: bool
) -> Uncertainty:
    """See `ffrobot.uncertainty`."""
    if by == "samples" and samples < FEWEST:
        raise InputError(f"uncertainty: expected at least {FEWEST} samples, found {samples}")
    if by == "gradients" and indices:
        raise InputError("uncertainty: expected Sobol indices of samples, found --by gradients")
    names = list(dict.fromkeys(of))
    goals = tuple(parse_goal(text) for text in names if not is_history(text))
    curves = tuple(Curve(text, text) for text in names if is_history(text))
    spreads = read_spreads(runs.path, spread)
    if not names or not spreads:
        raise InputError("uncertainty: expected at least one response or history (--of) and one key (--spread)")
    tolerance = TOLERANCE if by == "gradients" else None
    study = _Study(SpreadDesigns(runs, spreads, goals, others=curves, tolerance=tolerance), curves)
    return study.by_gradients() if by == "gradients" else study.by_samples(samples, seed, indices=indices)


def is_history(text: str) -> bool:
    """Whether a history as a whole is meant, no goal: one word."""
    return len(text.split()) == 1 and text.strip() != "mass"


class _Study:
    def __init__(self, designs: SpreadDesigns, curves: tuple[Curve, ...]) -> None:
        self._designs, self._curves = designs, curves
        self._spreads, self._goals, self._readings = designs.spreads, designs.goals, designs.readings
        self._nominal = tuple(curve.history(designs.middle) for curve in curves)
        pairs = zip(self._goals, self._readings, strict=True)
        self._notes = {f"peak of {g.text}": f"{g.text}: {one.remark}" for g, one in pairs if one.remark}

    def by_samples(self, count: int, seed: int, *, indices: bool) -> Uncertainty:
        """Of a Latin hypercube (McKay, Beckman & Conover 1979) of `count` points, keys paired for low discrepancy."""
        from scipy.stats.qmc import LatinHypercube

        k = len(self._spreads)
        if indices:
            both = LatinHypercube(2 * k, optimization="random-cd", seed=seed).random(count // 2)
            a, b = both[:, :k], both[:, k:]
            mixed = [np.where(np.arange(k) == i, b, a) for i in range(k)]
            u = np.concatenate([a, b, *mixed])
        else:
            u = LatinHypercube(k, optimization="random-cd", seed=seed).random(count)
        points = spread_points(self._spreads, u)
        designs = self._designs.run(points)
        values = np.array([self._designs.read(design) for design in designs])
        n = 2 * (count // 2) if indices else count  # those of the mixed points are no Latin hypercube
        whole = np.isfinite(values[:n]).all(axis=1) & [design.completed for design in designs[:n]]
        if whole.sum() < FEWEST:
            raise SolveError(
                f"{self._designs.path}: {n - whole.sum()} of {n} samples failed: {self._designs.failures[0]}"
            )
        x = np.array(points[:n])[whole]
        shares, explained = regression_shares(x, values[:n][whole])
        complete = [design for design, is_whole in zip(designs[:n], whole, strict=True) if is_whole]
        histories = (np.array([self._values(m, design) for design in complete]) for m in self._all())
        bands = tuple(self._band(m, statistics(of)) for m, of in enumerate(histories))
        blocks = values.reshape(-1, count // 2, len(self._goals)) if indices else None
        found = sobol_indices(blocks[0], blocks[1], blocks[2:], seed) if blocks is not None else None
        found_of_all = statistics(values[:n][whole])
        return self._found("samples", found_of_all, bands, shares, explained, found, values[:n], 1 + len(points))

    def by_gradients(self) -> Uncertainty:
        """Of the linear model, whose errors a quadratic one without products of keys tells."""
        points = [self._beside(k, sign) for k in range(len(self._spreads)) for sign in (1.0, -1.0)]
        designs = self._designs.run(points)
        centre = as_floats(np.array([one.value for one in self._readings]))
        pairs = np.array([self._follow(design) for design in designs]).reshape(len(self._spreads), 2, -1)
        self._check_sides(designs)
        model = LinearModel.through(self._spreads, centre, pairs)
        bands = []
        for m in self._all():
            sides = np.array([self._values(m, design) for design in designs])
            nominal = self._nominal[m].values[:, 0]
            curve = LinearModel.through(self._spreads, nominal, sides.reshape(len(self._spreads), 2, -1))
            bands.append(self._band(m, curve.statistics()))
        none = np.zeros((0, len(self._goals)))
        return self._found(
            "gradients", model.statistics(), tuple(bands), model.shares, np.full(len(self._goals), np.nan), None, none,
            1 + len(points),
        )  # fmt: skip

    def _all(self) -> range:
        return range(len(self._curves))

    def _beside(self, k: int, sign: float) -> Point:
        middle = self._designs.middle.point
        return (*middle[:k], middle[k] + sign * self._spreads[k].deviation, *middle[k + 1 :])

    def _check_sides(self, designs: Sequence[Design]) -> None:
        if failed := next((one for one in designs if not one.completed), None):
            where = f"{self._designs.path}: {self._designs.where(failed)}"
            raise SolveError(f"{where}: {failed.failure}; gradients need all runs, samples do without some")

    def _follow(self, design: Design) -> list[float]:
        """The goals beside the middle, peaks at their own times."""
        found = design.follow(self._goals, self._readings)
        for goal, one in zip(self._goals, found, strict=False):
            if one.elsewhere:
                kink = f"{goal.text}: a kink: with {self._designs.where(design)} the largest value is {one.elsewhere}"
                self._notes.setdefault(goal.text, f"{kink}; samples take it into account")
        return [one.value for one in found] or [float("nan")] * len(self._goals)

    def _values(self, m: int, design: Design) -> Array:
        found = self._curves[m].history(design)
        time = self._nominal[m].time
        if found.time.shape != time.shape or not np.allclose(found.time, time, rtol=1e-9, atol=1e-12):
            where = self._designs.where(design)
            raise InputError(f'--of: expected the same times of "{found.name}" in all runs, found others: {where}')
        return found.values[:, 0]

    def _band(self, m: int, found: Statistics) -> Band:
        nominal = self._nominal[m]
        return Band(nominal.name, nominal.unit, nominal.time, nominal.values[:, 0], found)

    def _found(
        self, method: LinearOrSampled, found: Statistics, bands: tuple[Band, ...], shares: Array, explained: Array,
        indices: Indices | None, samples: Array, runs: int,
    ) -> Uncertainty:  # fmt: skip
        return Uncertainty(
            self._designs.path, self._spreads, method, tuple(goal.text for goal in self._goals), self._readings, found,
            bands, shares, explained, indices, samples, tuple(self._designs.failures),
            tuple(self._notes.values()), runs, self._designs.table,
        )  # fmt: skip
