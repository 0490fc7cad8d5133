"""Uncertainty of results under distributions of keys: `ffrobot uncertainty`, by samples or by gradients.

Samples are a Latin hypercube of the keys' distributions. With `indices` they are two of half the size, A and B, and A
with the column of each key from B. Gradients take two runs for each key, one standard deviation to both sides, whose
curvature is the estimated error.
"""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from ..common.arrays import Array
from ..common.errors import InputError, SolveError
from ..common.libraries import scipy
from ..sweep.sweep import check_once
from .designs import Design, Designs, Point, Runs, changes_for, in_words, moved
from .readings import Peak, Response, read_column
from .responses import parse_response
from .spreads import (
    Spread,
    SpreadStatistics,
    linear_statistics,
    parse_spread,
    regression_shares,
    sobol_indices,
    statistics,
)
from .uncertainty_record import HistoryBand, LinearOrSampled, Uncertainty

TOLERANCE = 1e-8  # of runs for gradients, at most: differences of one standard deviation
FEWEST = 8  # samples for a quantile of 5 %


def find_uncertainty(
    runs: Runs, of: Sequence[str], spread: Sequence[str], samples: int, seed: int, by: LinearOrSampled, *, indices: bool
) -> Uncertainty:
    """Return statistics of responses `of` for distributions `spread`; arguments as of `ffrobot.uncertainty`."""
    if by == "samples" and samples < FEWEST:
        raise InputError(f"uncertainty: expected at least {FEWEST} samples", samples)
    if by == "gradients" and indices:
        raise InputError("uncertainty: expected Sobol indices of samples", "--by gradients")
    names = list(dict.fromkeys(of))
    histories = [text for text in names if len(text.split()) == 1 and text.strip() != "mass"]
    responses = tuple(parse_response(text) for text in names if text not in histories)
    spreads = tuple(parse_spread(text, runs.path) for text in spread)
    check_once([one.key for one in spreads], "--spread")
    if not names or not spreads:
        raise InputError("uncertainty: expected at least one response or history (--of) and one key (--spread)")
    study = _Study(runs, spreads, responses, histories, TOLERANCE if by == "gradients" else None)
    return study.by_gradients() if by == "gradients" else study.by_samples(samples, seed, indices=indices)


class _Study:
    """Designs by the values of uncertain keys, and nominal responses and histories.

    Raises `InputError` for spreads that make scenes impossible, `SolveError` where the nominal scene fails.
    """

    def __init__(
        self,
        runs: Runs,
        spreads: tuple[Spread, ...],
        responses: tuple[Response, ...],
        histories: Sequence[str],
        tolerance: float | None,
    ) -> None:
        self._path, self._spreads, self._responses = runs.path, spreads, responses
        self._point: Point = tuple(one.mean for one in spreads)
        fixed = changes_for(runs.path, (*responses, *(Peak(name, name) for name in histories)), tolerance)
        self._designs = Designs(runs, [one.key for one in spreads], tuple(one.own for one in spreads), fixed)
        for k, one in enumerate(spreads):
            for end in one.ends:
                if problem := self._designs.problem(moved(self._point, k, end)):
                    raise InputError(
                        "--spread: expected spreads with which the scene makes sense", f"{one.text}:\n{problem}"
                    )
        middle = self._designs.run_first(self._point)
        self._readings = middle.read(responses)
        with middle.results() as results:
            self._nominal = [read_column(results, name, "--of") for name in histories]
        self._failures: list[str] = []
        pairs = zip(responses, self._readings, strict=True)
        self._notes = {f"peak of {g.text}": f"{g.text}: {one.remark}" for g, one in pairs if one.remark}

    def by_samples(self, count: int, seed: int, *, indices: bool) -> Uncertainty:
        """Return statistics of `count` points of a Latin hypercube (McKay, Beckman & Conover 1979)."""
        k = len(self._spreads)
        cube = scipy.stats.qmc.LatinHypercube(2 * k if indices else k, optimization="random-cd", seed=seed)
        u = cube.random(count // 2 if indices else count)
        if indices:
            a, b = np.hsplit(u, 2)
            u = np.concatenate([a, b, *(np.where(np.arange(k) == i, b, a) for i in range(k))])
        columns = [spread.values(column) for spread, column in zip(self._spreads, u.T, strict=True)]
        points = [tuple(map(float, row)) for row in np.transpose(columns)]
        designs = self._designs.run(points)
        values = np.array([self._read(design) for design in designs])
        n = 2 * (count // 2) if indices else count  # those of the mixed points are no Latin hypercube
        whole = np.isfinite(values[:n]).all(axis=1) & [design.completed for design in designs[:n]]
        if whole.sum() < FEWEST:
            raise SolveError(f"{self._path}: {n - whole.sum()} of {n} samples failed: {self._failures[0]}")
        shares, explained = regression_shares(np.array(points[:n])[whole], values[:n][whole])
        complete = [design for design, is_whole in zip(designs[:n], whole, strict=True) if is_whole]
        blocks = values.reshape(-1, count // 2, len(self._responses)) if indices else None
        return self._found(
            method="samples",
            statistics=statistics(values[:n][whole]),
            bands=self._bands(complete, lambda nominal, of_designs: statistics(of_designs)),
            shares=shares,
            explained=explained,
            indices=sobol_indices(blocks[0], blocks[1], blocks[2:], seed) if blocks is not None else None,
            samples=values[:n],
            runs=1 + len(points),
        )

    def by_gradients(self) -> Uncertainty:
        """Return statistics of the linear model; a quadratic one without products of keys estimates its errors."""
        sides = [(k, sign * one.deviation) for k, one in enumerate(self._spreads) for sign in (1.0, -1.0)]
        designs = self._designs.run([moved(self._point, k, self._point[k] + offset) for k, offset in sides])
        if failed := next((one for one in designs if not one.completed), None):
            raise SolveError(
                f"{self._path}: {self._where(failed)}: {failed.failure}; gradients need all runs, samples do without"
                " some"
            )
        pairs = np.array([self._follow(design) for design in designs])

        def linear(nominal: Array, of_designs: Array) -> tuple[SpreadStatistics, Array]:
            return linear_statistics(self._spreads, nominal, of_designs.reshape(len(self._spreads), 2, -1))

        of_responses, shares = linear(np.array([one.value for one in self._readings]), pairs)
        return self._found(
            method="gradients",
            statistics=of_responses,
            bands=self._bands(designs, lambda nominal, of_designs: linear(nominal, of_designs)[0]),
            shares=shares,
            explained=np.full(len(self._responses), np.nan),
            indices=None,
            samples=np.zeros((0, len(self._responses))),
            runs=1 + len(sides),
        )

    def _found(self, **by_method: Any) -> Uncertainty:
        return Uncertainty(
            scene=self._path,
            spreads=self._spreads,
            readings={of.text: one for of, one in zip(self._responses, self._readings, strict=True)},
            failures=tuple(self._failures),
            notes=tuple(self._notes.values()),
            table=self._designs.table,
            **by_method,
        )

    def _read(self, design: Design) -> list[float]:
        """The responses, NaN where the design failed or does not have them."""
        failure = design.failure
        try:
            if not failure:
                return [one.value for one in design.read(self._responses)]
        except InputError as error:
            failure = str(error)
        self._failures.append(f"{self._where(design)}: {failure}")
        return [np.nan] * len(self._responses)

    def _follow(self, design: Design) -> list[float]:
        followed = design.follow(self._responses, self._readings)
        for response, one in zip(self._responses, followed, strict=False):
            if one.elsewhere:
                kink = f"{response.text}: a kink: with {self._where(design)} the largest value is {one.elsewhere}"
                self._notes.setdefault(response.text, f"{kink}; samples take it into account")
        return [one.value for one in followed]

    def _bands(
        self, designs: Sequence[Design], of: Callable[[Array, Array], SpreadStatistics]
    ) -> tuple[HistoryBand, ...]:
        """Statistics `of` each history: with nominal values (T,), and of the designs (n, T)."""
        bands = []
        for nominal in self._nominal:
            time, middle = nominal.time, nominal.values[:, 0]
            values = np.empty((len(designs), time.size))
            for row, design in zip(values, designs, strict=True):
                with design.results() as results:
                    history = read_column(results, nominal.name, "--of")
                if history.time.shape != time.shape or not np.allclose(history.time, time, rtol=1e-9, atol=1e-12):
                    what = f"others: {self._where(design)}"
                    raise InputError(f'--of: expected the same times of "{nominal.name}" in all runs', what)
                row[:] = history.values[:, 0]
            bands.append(HistoryBand(nominal.name, nominal.unit, time, middle, of(middle, values)))
        return tuple(bands)

    def _where(self, design: Design) -> str:
        return in_words((one.key for one in self._spreads), design.point)
