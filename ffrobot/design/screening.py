"""Which of many keys matter at all: `ffrobot uncertainty --by screening`, by elementary effects.

They are those of Morris (Technometrics 33, 1991). A trajectory begins at a point of a grid with an even number of
levels in the unit cube and changes one key after the other, each once, by Δ = levels / (2 (levels − 1)): k + 1 points
give an elementary effect δf/δu of each of k keys. Of r trajectories μ is the mean of a key's effects, σ their standard
deviation, and μ* the mean of their sizes, which does not cancel (Campolongo, Cariboni & Saltelli, Environmental
Modelling & Software 22, 2007). Of a linear function μ* is the change of f over the whole range of the key, and σ is 0;
where σ is as large as μ*, the key bends f, or acts with others.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..common.arrays import Array, Integers, NDArray, as_floats
from ..common.errors import InputError, SolveError
from ..pictures.studies.study import Points
from .designs import Runs
from .finding import CsvFile, Finding, Section, failed_runs, file_name, floats, with_unit
from .goals import parse_goal
from .readings import Reading
from .spreads import Spread, SpreadDesigns, read_spreads
from .uncertainty import is_history
from .uncertainty_record import UNCHANGED, goal_line, with_error

HEADINGS = ("key", "spread", "μ*", "σ", "μ")
COLUMNS = ("goal", "unit", "middle", "key", "mu_star", "mu_star_error", "sigma", "mu", "effects")


@dataclass(frozen=True)
class Screening(Finding):
    """Elementary effects of k keys, over their whole distributions, on g responses.

    Attributes:
        scene: its file.
        spreads: (k,) distributions of the keys; a normal one is taken two standard deviations to both sides.
        goals, readings: (g,) the responses, and their values with all keys at nominal values.
        effects: (g, k) μ*, σ and μ, in units of the responses.
        values: (r, k + 1, g) the responses along the trajectories, NaN for failed runs.
        failures: failed runs in words; `runs` is the number of all, `table` their file.
    """

    name = "screening"
    title = "Screening"

    scene: Path
    spreads: tuple[Spread, ...]
    goals: tuple[str, ...]
    readings: tuple[Reading, ...]
    effects: Effects
    values: Array
    failures: tuple[str, ...]
    runs: int
    table: Path | None

    def headline(self) -> str:
        """The key with the largest influence on each response."""
        first = [".".join(self.spreads[self.ranked(g)[0]].key) for g in range(len(self.goals))]
        return "; ".join(f"{goal}: {key} matters most" for goal, key in zip(self.goals, first, strict=True))

    def sections(self) -> Iterator[Section]:
        """A table for each response, the most influential key first."""
        for g, (goal, reading) in enumerate(zip(self.goals, self.readings, strict=True)):
            yield Section(HEADINGS, self._rows(g), line=goal_line(goal, reading), of=goal)

    def remarks(self) -> Iterator[str]:
        """What there is to mind, and how it was found."""
        for goal, sizes in zip(self.goals, self.effects.mu_star, strict=True):
            if not np.nan_to_num(sizes).any():
                yield f"note       {goal}: {UNCHANGED}"
        for goal, counts in zip(self.goals, self.effects.count, strict=True):
            for one, count in zip(self.spreads, counts, strict=True):
                if count < len(self.values):
                    left = f"{count} of {len(self.values)} effects, runs of the others failed"
                    yield f"note       {goal} by {'.'.join(one.key)}: {left}"
        yield from failed_runs(self.failures, self.runs)
        yield (
            f"how        {self.runs} runs, {len(self.values)} trajectories (Morris); μ*: mean absolute change of the"
            " response over the whole range of a parameter, ± its standard error. σ: standard deviation, near 0 if the"
            " response is linear in the parameter, as large as μ* with nonlinearity or interaction; μ: signed mean"
        )

    def csv_files(self) -> Iterator[CsvFile]:
        """One line for each response and key."""
        yield CsvFile("screening.csv", "table of elementary effects", COLUMNS, self._numbers())

    def _numbers(self) -> Iterator[list[object]]:
        e = self.effects
        for g, (goal, reading) in enumerate(zip(self.goals, self.readings, strict=True)):
            for k, one in enumerate(self.spreads):
                values = [float(of[g, k]) for of in (e.mu_star, e.mu_star_error, e.sigma, e.mu)]
                yield [goal, reading.unit, reading.value, ".".join(one.key), *values, int(e.count[g, k])]

    def diagrams(self) -> list[Points]:
        """μ* against σ for each response."""
        return [self._points(g) for g in range(len(self.goals))]

    def ranked(self, g: int) -> list[int]:
        """Keys by number, the largest μ* of response g first."""
        return [int(k) for k in np.argsort(-np.nan_to_num(self.effects.mu_star[g]), kind="stable")]

    def _rows(self, g: int) -> list[tuple[str, ...]]:
        e = self.effects
        return [
            (
                ".".join(self.spreads[k].key),
                self.spreads[k].text.partition("=")[2],
                with_error(e.mu_star[g, k], e.mu_star_error[g, k]),
                *("" if np.isnan(value[g, k]) else f"{value[g, k]:.4g}" for value in (e.sigma, e.mu)),
            )
            for k in self.ranked(g)
        ]

    def _points(self, g: int) -> Points:
        """Of keys that have effects."""
        e, unit = self.effects, self.readings[g].unit
        known = [k for k in self.ranked(g) if e.count[g, k]]
        return Points(
            name=f"screening_{file_name(self.goals[g])}", title=self.goals[g], x_label=with_unit("μ*", unit),
            y_label=with_unit("σ", unit), labels=tuple(".".join(self.spreads[k].key) for k in known),
            x=floats(e.mu_star[g, known]), y=floats(e.sigma[g, known]), x_errors=floats(e.mu_star_error[g, known]),
            named=True,
        )  # fmt: skip


LEVELS = 4


@dataclass(frozen=True)
class Trajectories:
    """r trajectories: `points` (r, k + 1, k) in the unit cube, and the key that each step changes, `order` (r, k)."""

    points: Array
    order: Integers


@dataclass(frozen=True)
class Effects:
    """Of g responses by k keys, in units of the responses: `mu`, `mu_star`, its standard error and `sigma`, all (g, k).

    `count` (g, k) of effects that they are made from; NaN where there is none, of σ and errors where there is one.
    """

    mu: Array
    mu_star: Array
    mu_star_error: Array
    sigma: Array
    count: Integers


def draw_trajectories(keys: int, count: int, seed: int) -> Trajectories:
    """So many of them; a Latin hypercube has them begin at all levels of every key alike."""
    from scipy.stats.qmc import LatinHypercube

    start = np.floor(LEVELS * LatinHypercube(keys, seed=seed).random(count)).astype(int)
    step = np.where(start < LEVELS // 2, LEVELS // 2, -(LEVELS // 2))  # from the lower half up, else down
    order = np.random.default_rng(seed).permuted(np.tile(np.arange(keys), (count, 1)), axis=1)
    turn = np.argsort(order, axis=1)  # (r, k) when each key is changed
    changed = np.arange(keys + 1)[None, :, None] > turn[:, None, :]
    points = (start[:, None, :] + changed * step[:, None, :]) / (LEVELS - 1)
    return Trajectories(as_floats(points), order)


def elementary_effects(taken: Trajectories, values: Array) -> Effects:
    """Effects from `values` (r, k + 1, g) at all points; a failed run, NaN, costs the effects on both sides."""
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


FEWEST = 2  # trajectories: of one there is no σ


def find_effects(runs: Runs, of: Sequence[str], spread: Sequence[str], trajectories: int, seed: int) -> Screening:
    """See `ffrobot.screening`."""
    if trajectories < FEWEST:
        raise InputError(f"uncertainty: --trajectories: expected at least {FEWEST}, found {trajectories}")
    names = list(dict.fromkeys(of))
    if histories := [text for text in names if is_history(text)]:
        raise InputError(
            f'--of: expected responses for --by screening, such as "peak {histories[0]}", found the history'
            f' "{histories[0]}", whose band --by samples or --by gradients computes'
        )
    goals, spreads = tuple(map(parse_goal, names)), read_spreads(runs.path, spread)
    if not goals or not spreads:
        raise InputError("uncertainty: expected at least one response (--of) and one key (--spread)")
    designs = SpreadDesigns(runs, spreads, goals)
    taken = draw_trajectories(len(spreads), trajectories, seed)
    low, high = np.array([one.ends for one in spreads]).T
    points = (low + (high - low) * taken.points).reshape(-1, len(spreads))
    found = designs.run([tuple(map(float, point)) for point in points])
    values = np.array([designs.read(design) for design in found]).reshape(trajectories, -1, len(goals))
    effects = elementary_effects(taken, as_floats(values))
    if not effects.count.any():
        raise SolveError(f"{runs.path}: no two runs of a trajectory side by side completed: {designs.failures[0]}")
    return Screening(
        runs.path, spreads, tuple(goal.text for goal in goals), designs.readings, effects, as_floats(values),
        tuple(dict.fromkeys(designs.failures)), 1 + len({design.folder for design in found}), designs.table,
    )  # fmt: skip
