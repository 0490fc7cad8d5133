"""How sure results are where keys are spread: `ffrobot uncertainty`, by samples or by gradients.

Samples are a Latin hypercube of the keys' distributions. With `indices` they are two of half the size, A and B, and for
every key A with that column from B: Sobol indices need no other runs. Gradients take two runs for each key, one
standard deviation to both sides; what these say of curvature is the estimate of the error.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from ..common.arrays import Array, as_floats
from ..common.errors import InputError, SolveError
from ..common.parallel import processes as of_mpi
from ..run.watcher import Watcher
from .designs import Design, Designs, Point
from .goals import parse_goal
from .histories import History, read_history
from .linear_spread import LinearModel
from .readings import Goal, Reading
from .scenes import changes_for
from .spreads import Spread, parse_spread, spread_points
from .statistics import Indices, Statistics, regression_shares, sobol_indices, statistics

TOLERANCE = 1e-8  # of runs for gradients, at most: differences of one standard deviation
FEWEST = 8  # samples that a quantile of 5 % is told from


@dataclass(frozen=True)
class Curve(Goal):
    """A history as a whole."""

    text: str

    @property
    def analysis(self) -> str:  # type: ignore[override]
        """The first part of the name."""
        return self.text.replace("/", ".").partition(".")[0]

    def history(self, results_of: Design) -> History:
        """Of one column."""
        with results_of.results() as results:
            found = read_history(results, self.text, "--of")
        if found.values.shape[1] > 1:
            count = found.values.shape[1]
            raise InputError(f'--of: expected one column, such as "{self.text}[0]", found {count} of "{self.text}"')
        return found


@dataclass(frozen=True)
class Band:
    """A history's statistics at `time` (T,), s; `nominal` (T,) with all keys at the middle of their spreads."""

    name: str
    unit: str
    time: Array
    nominal: Array
    statistics: Statistics


@dataclass(frozen=True)
class Uncertainty:
    """What is known of g goals and some histories with k keys spread.

    Attributes:
        scene: its file.
        spreads: (k,) of the keys.
        method: how it was found.
        goals, readings: (g,) what was asked for, and with all keys at the middle of their spreads.
        statistics: of the goals, (g,).
        bands: of the histories.
        shares: (g, k) of the variance by the linear part; `explained` (g,) what part of it that is, NaN by gradients.
        indices: Sobol's, where they were asked for.
        samples: (n, g) the goals, NaN where a run failed; (0, g) by gradients.
        failures: runs that failed, in words; `runs` in all, of which `table` is the file.
        notes: peaks, by gradients, that others overtake beside the middle.
    """

    scene: Path
    spreads: tuple[Spread, ...]
    method: Literal["samples", "gradients"]
    goals: tuple[str, ...]
    readings: tuple[Reading, ...]
    statistics: Statistics
    bands: tuple[Band, ...]
    shares: Array
    explained: Array
    indices: Indices | None
    samples: Array
    failures: tuple[str, ...]
    notes: tuple[str, ...]
    runs: int
    table: Path | None


def uncertainty(
    path: Path,
    of: Sequence[str],
    spread: Sequence[str],
    folder: Path,
    *,
    samples: int = 200,
    seed: int = 0,
    by: Literal["samples", "gradients"] = "samples",
    indices: bool = False,
    processes: int = 1,
    retry: bool = False,
    watcher: Watcher | None = None,
) -> Uncertainty:
    """Statistics of goals and histories `of` the scene file at `path` with keys `spread`; runs stay in `folder`.

    Raises:
        InputError: goals, keys or spreads that mean nothing, or that make scenes impossible.
        SolveError: the scene with all keys in the middle, or all others, cannot be solved.
    """
    if of_mpi() > 1:
        raise InputError("uncertainty: expected one process, found several under mpirun: -j runs samples side by side")
    if by == "samples" and samples < FEWEST:
        raise InputError(f"uncertainty: expected at least {FEWEST} samples, found {samples}")
    if by == "gradients" and indices:
        raise InputError("uncertainty: expected Sobol indices of samples, found them asked for by gradients")
    names = list(dict.fromkeys(of))
    goals = tuple(parse_goal(text) for text in names if not _is_history(text))
    curves = tuple(Curve(text) for text in names if _is_history(text))
    spreads = _spreads(path, spread)
    if not names or not spreads:
        raise InputError("uncertainty: expected at least one goal or history (--of) and one key (--spread)")
    fixed = changes_for(path, (*goals, *curves), TOLERANCE if by == "gradients" else None)
    keys, own = [one.key for one in spreads], tuple(one.own for one in spreads)
    designs = Designs(path, keys, own, folder, fixed, processes=processes, watcher=watcher or Watcher(), retry=retry)
    middle = _middle(path, designs, spreads)
    study = _Study(path, spreads, goals, curves, designs, middle)
    return study.by_gradients() if by == "gradients" else study.by_samples(samples, seed, indices=indices)


def _is_history(text: str) -> bool:
    return len(text.split()) == 1 and text.strip() != "mass"


def _spreads(path: Path, texts: Sequence[str]) -> tuple[Spread, ...]:
    spreads = tuple(parse_spread(text, path) for text in texts)
    keys = [one.key for one in spreads]
    for key in keys:
        if keys.count(key) > 1:
            raise InputError(f"--spread: expected every key once, found {'.'.join(key)} {keys.count(key)} times")
    return spreads


def _middle(path: Path, designs: Designs, spreads: Sequence[Spread]) -> Design:
    """The design with all keys in the middle, which has to be there, and to make sense at their ends."""
    centre = tuple(one.mean for one in spreads)
    for k, one in enumerate(spreads):
        for end in one.ends:
            if problem := designs.problem((*centre[:k], end, *centre[k + 1 :])):
                raise InputError(
                    f"--spread: expected spreads with which the scene makes sense, found {one.text}:\n{problem}"
                )
    (design,) = designs.run([centre])
    if not design.completed:
        error = InputError if design.row.status == "wrong input" else SolveError
        raise error(f"{path}: {design.row.status}: {design.row.message}")
    return design


class _Study:
    """Runs, and what they say."""

    def __init__(
        self,
        path: Path,
        spreads: tuple[Spread, ...],
        goals: tuple[Goal, ...],
        curves: tuple[Curve, ...],
        designs: Designs,
        middle: Design,
    ) -> None:
        self._path, self._spreads, self._goals, self._curves = path, spreads, goals, curves
        self._designs, self._middle = designs, middle
        with middle.results() as results:
            self._readings = tuple(goal.read(results) for goal in goals)
        self._nominal = tuple(curve.history(middle) for curve in curves)
        self._failures: list[str] = []
        self._notes: dict[str, str] = {}

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
        values = np.array([self._read(design) for design in designs])
        n = 2 * (count // 2) if indices else count  # those of the mixed points are no Latin hypercube
        whole = np.isfinite(values[:n]).all(axis=1) & [design.completed for design in designs[:n]]
        if whole.sum() < FEWEST:
            raise SolveError(f"{self._path}: {n - whole.sum()} of {n} samples failed: {self._failures[0]}")
        x = np.array(points[:n])[whole]
        shares, explained = regression_shares(x, values[:n][whole])
        bands = tuple(self._sampled(m, [d for d, w in zip(designs[:n], whole, strict=True) if w]) for m in self._all())
        blocks = values.reshape(-1, count // 2, len(self._goals)) if indices else None
        found = sobol_indices(blocks[0], blocks[1], blocks[2:], seed) if blocks is not None else None
        return self._found(
            "samples", statistics(values[:n][whole]), bands, shares, explained, found, values[:n], 1 + len(points)
        )

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
        middle = self._middle.point
        return (*middle[:k], middle[k] + sign * self._spreads[k].deviation, *middle[k + 1 :])

    def _check_sides(self, designs: Sequence[Design]) -> None:
        if failed := next((one for one in designs if not one.completed), None):
            raise SolveError(
                f"{self._path}: {self._where(failed)}: {failed.row.status}: {failed.row.message}; gradients need all"
                " runs, samples do without some"
            )

    def _read(self, design: Design) -> list[float]:
        """The goals of a sample, NaN where it failed or does not have them."""
        if design.completed:
            try:
                with design.results() as results:
                    return [goal.read(results).value for goal in self._goals]
            except InputError as error:
                self._failures.append(f"{self._where(design)}: {error}")
        else:
            self._failures.append(f"{self._where(design)}: {design.row.status}: {design.row.message}")
        return [float("nan")] * len(self._goals)

    def _follow(self, design: Design) -> list[float]:
        """The goals beside the middle, peaks at their own times."""
        if not design.completed:
            return [float("nan")] * len(self._goals)
        with design.results() as results:
            found = [g.follow(results, r) for g, r in zip(self._goals, self._readings, strict=True)]
        for goal, one in zip(self._goals, found, strict=True):
            if one.elsewhere:
                kink = f"{goal.text}: a kink: with {self._where(design)} the largest value is {one.elsewhere}"
                self._notes.setdefault(goal.text, f"{kink}; samples take it into account")
        return [one.value for one in found]

    def _values(self, m: int, design: Design) -> Array:
        """History m (T,), at the times of the one in the middle."""
        found = self._curves[m].history(design)
        time = self._nominal[m].time
        if found.time.shape != time.shape or not np.allclose(found.time, time, rtol=1e-9, atol=1e-12):
            raise InputError(
                f'--of: expected the same times of "{found.name}" in all runs, found others: {self._where(design)}'
            )
        return found.values[:, 0]

    def _sampled(self, m: int, designs: Sequence[Design]) -> Band:
        return self._band(m, statistics(np.array([self._values(m, design) for design in designs])))

    def _band(self, m: int, found: Statistics) -> Band:
        nominal = self._nominal[m]
        return Band(nominal.name, nominal.unit, nominal.time, nominal.values[:, 0], found)

    def _where(self, design: Design) -> str:
        return ", ".join(
            f"{'.'.join(one.key)} = {value:.6g}" for one, value in zip(self._spreads, design.point, strict=True)
        )

    def _found(
        self,
        method: Literal["samples", "gradients"],
        found: Statistics,
        bands: tuple[Band, ...],
        shares: Array,
        explained: Array,
        indices: Indices | None,
        samples: Array,
        runs: int,
    ) -> Uncertainty:
        return Uncertainty(
            self._path, self._spreads, method, tuple(goal.text for goal in self._goals), self._readings, found, bands,
            shares, explained, indices, samples, tuple(self._failures),
            tuple(self._notes.values()), runs, self._designs.table,
        )  # fmt: skip
