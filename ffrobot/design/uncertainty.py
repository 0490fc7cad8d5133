"""How sure results are where keys are spread: `ffrobot uncertainty`, by samples or by gradients.

Samples are a Latin hypercube of the keys' distributions. With `indices` they are two of half the size, A and B, and for
every key A with that column from B: Sobol indices need no other runs. Gradients take two runs for each key, one
standard deviation to both sides; what these say of curvature is the estimate of the error.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..common.arrays import Array
from ..common.errors import InputError, SolveError
from ..common.libraries import scipy
from .designs import Design, Designs, Point, Runs, changes_for, in_words
from .readings import History, Response, read_column
from .responses import parse_response
from .spreads import (
    LinearSpread,
    Spread,
    SpreadStatistics,
    read_spreads,
    regression_shares,
    sobol_indices,
    spread_points,
    statistics,
)
from .uncertainty_record import HistoryBand, LinearOrSampled, Uncertainty

TOLERANCE = 1e-8  # of runs for gradients, at most: differences of one standard deviation
FEWEST = 8  # samples for a quantile of 5 %


@dataclass(frozen=True)
class WholeHistory(Response):
    """A history as a whole."""

    text: str
    name: str

    def history(self, results_of: Design) -> History:
        """Return the history of a completed design. Raises `InputError` for several columns."""
        with results_of.results() as results:
            return read_column(results, self.text, "--of")


def find_uncertainty(
    runs: Runs, of: Sequence[str], spread: Sequence[str], samples: int, seed: int, by: LinearOrSampled, *, indices: bool
) -> Uncertainty:
    """Propagate distributions of keys: see `ffrobot.uncertainty`."""
    if by == "samples" and samples < FEWEST:
        raise InputError(f"uncertainty: expected at least {FEWEST} samples", samples)
    if by == "gradients" and indices:
        raise InputError("uncertainty: expected Sobol indices of samples", "--by gradients")
    names = list(dict.fromkeys(of))
    responses = tuple(parse_response(text) for text in names if not _is_history(text))
    curves = tuple(WholeHistory(text, text) for text in names if _is_history(text))
    spreads = read_spreads(runs.path, spread)
    if not names or not spreads:
        raise InputError("uncertainty: expected at least one response or history (--of) and one key (--spread)")
    study = _Study(runs, spreads, responses, curves, TOLERANCE if by == "gradients" else None)
    return study.by_gradients() if by == "gradients" else study.by_samples(samples, seed, indices=indices)


def _is_history(text: str) -> bool:
    return len(text.split()) == 1 and text.strip() != "mass"


class _Study:
    """Designs by the values of keys that are spread, and what responses and histories are with nominal values.

    Making it raises `InputError` for spreads that make scenes impossible, `SolveError` where the nominal scene fails.
    """

    def __init__(
        self,
        runs: Runs,
        spreads: tuple[Spread, ...],
        responses: tuple[Response, ...],
        curves: tuple[WholeHistory, ...],
        tolerance: float | None,
    ) -> None:
        self._path, self._spreads, self._responses, self._curves = runs.path, spreads, responses, curves
        self._point: Point = tuple(one.mean for one in spreads)
        fixed = changes_for(runs.path, (*responses, *curves), tolerance)
        self._designs = Designs(runs, [one.key for one in spreads], tuple(one.own for one in spreads), fixed)
        for k, one in enumerate(spreads):
            for end in one.ends:
                if problem := self._designs.problem(self._moved(k, end)):
                    raise InputError(
                        "--spread: expected spreads with which the scene makes sense", f"{one.text}:\n{problem}"
                    )
        middle = self._designs.run_first(self._point)
        self._readings = middle.read(responses)
        self._nominal = tuple(curve.history(middle) for curve in curves)
        self._failures: list[str] = []
        pairs = zip(responses, self._readings, strict=True)
        self._notes = {f"peak of {g.text}": f"{g.text}: {one.remark}" for g, one in pairs if one.remark}

    def by_samples(self, count: int, seed: int, *, indices: bool) -> Uncertainty:
        """Return statistics of `count` points of a Latin hypercube (McKay, Beckman & Conover 1979)."""
        k = len(self._spreads)
        if indices:
            both = scipy.stats.qmc.LatinHypercube(2 * k, optimization="random-cd", seed=seed).random(count // 2)
            a, b = both[:, :k], both[:, k:]
            mixed = [np.where(np.arange(k) == i, b, a) for i in range(k)]
            u = np.concatenate([a, b, *mixed])
        else:
            u = scipy.stats.qmc.LatinHypercube(k, optimization="random-cd", seed=seed).random(count)
        points = spread_points(self._spreads, u)
        designs = self._designs.run(points)
        values = np.array([self._read(design) for design in designs])
        n = 2 * (count // 2) if indices else count  # those of the mixed points are no Latin hypercube
        whole = np.isfinite(values[:n]).all(axis=1) & [design.completed for design in designs[:n]]
        if whole.sum() < FEWEST:
            raise SolveError(f"{self._path}: {n - whole.sum()} of {n} samples failed: {self._failures[0]}")
        shares, explained = regression_shares(np.array(points[:n])[whole], values[:n][whole])
        complete = [design for design, is_whole in zip(designs[:n], whole, strict=True) if is_whole]
        bands = self._bands(complete, lambda nominal, of_designs: statistics(of_designs))
        blocks = values.reshape(-1, count // 2, len(self._responses)) if indices else None
        return Uncertainty(
            method="samples",
            statistics=statistics(values[:n][whole]),
            bands=bands,
            shares=shares,
            explained=explained,
            indices=sobol_indices(blocks[0], blocks[1], blocks[2:], seed) if blocks is not None else None,
            samples=values[:n],
            runs=1 + len(points),
            **self._common(),
        )

    def by_gradients(self) -> Uncertainty:
        """Return statistics of the linear model; a quadratic one without products of keys estimates its errors."""
        sides = [(k, sign * one.deviation) for k, one in enumerate(self._spreads) for sign in (1.0, -1.0)]
        designs = self._designs.run([self._moved(k, self._point[k] + offset) for k, offset in sides])
        pairs = np.array([self._follow(design) for design in designs])
        if failed := next((one for one in designs if not one.completed), None):
            raise SolveError(
                f"{self._path}: {self._where(failed)}: {failed.failure}; gradients need all runs, samples do without"
                " some"
            )
        model = self._linear(np.array([one.value for one in self._readings]), pairs)
        return Uncertainty(
            method="gradients",
            statistics=model.statistics(),
            bands=self._bands(designs, lambda nominal, of_designs: self._linear(nominal, of_designs).statistics()),
            shares=model.shares,
            explained=np.full(len(self._responses), np.nan),
            indices=None,
            samples=np.zeros((0, len(self._responses))),
            runs=1 + len(sides),
            **self._common(),
        )

    def _common(self) -> dict[str, Any]:
        return {
            "scene": self._path,
            "spreads": self._spreads,
            "responses": tuple(response.text for response in self._responses),
            "readings": self._readings,
            "failures": tuple(self._failures),
            "notes": tuple(self._notes.values()),
            "table": self._designs.table,
        }

    def _linear(self, middle: Array, sides: Array) -> LinearSpread:
        return LinearSpread.through(self._spreads, middle, sides.reshape(len(self._spreads), 2, -1))

    def _moved(self, k: int, value: float) -> Point:
        return (*self._point[:k], value, *self._point[k + 1 :])

    def _read(self, design: Design) -> list[float]:
        """The responses, NaN where the design failed or does not have them."""
        failure = design.failure
        try:
            if not failure:
                return [one.value for one in design.read(self._responses)]
        except InputError as error:
            failure = str(error)
        self._failures.append(f"{self._where(design)}: {failure}")
        return [float("nan")] * len(self._responses)

    def _follow(self, design: Design) -> list[float]:
        """The responses beside the middle, peaks at their own times."""
        followed = design.follow(self._responses, self._readings)
        for response, one in zip(self._responses, followed, strict=False):
            if one.elsewhere:
                kink = f"{response.text}: a kink: with {self._where(design)} the largest value is {one.elsewhere}"
                self._notes.setdefault(response.text, f"{kink}; samples take it into account")
        return [one.value for one in followed] or [float("nan")] * len(self._responses)

    def _bands(
        self, designs: Sequence[Design], of: Callable[[Array, Array], SpreadStatistics]
    ) -> tuple[HistoryBand, ...]:
        """Statistics `of` each history: with nominal values (T,), and of the designs (n, T)."""
        bands = []
        for curve, nominal in zip(self._curves, self._nominal, strict=True):
            values, middle = np.array([self._values(curve, nominal, one) for one in designs]), nominal.values[:, 0]
            bands.append(HistoryBand(nominal.name, nominal.unit, nominal.time, middle, of(middle, values)))
        return tuple(bands)

    def _values(self, curve: WholeHistory, nominal: History, design: Design) -> Array:
        history, time = curve.history(design), nominal.time
        if history.time.shape != time.shape or not np.allclose(history.time, time, rtol=1e-9, atol=1e-12):
            raise InputError(
                f'--of: expected the same times of "{history.name}" in all runs', f"others: {self._where(design)}"
            )
        return history.values[:, 0]

    def _where(self, design: Design) -> str:
        return in_words((one.key for one in self._spreads), design.point)
