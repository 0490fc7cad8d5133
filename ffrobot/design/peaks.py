"""Peaks of histories, and the local ones that may take turns as the largest.

A peak belongs to a time and a column: its derivative by a parameter is that of the history there (envelope theorem,
Danskin 1966), as long as no other time overtakes it. The time is that of the top itself, where d/dt = 0, which lies
between outputs. Where others overtake it, the largest of several is no smooth function of the parameters, but each
local peak is one: `parts` divides the outputs of a history into windows with one of them each, whose largest values
together are the peak wherever they move.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Literal

import numpy as np

from ..common.arrays import Array
from ..common.peaks import top_at
from ..results.file import Results
from .histories import History, read_history
from .readings import Followed, Goal, Reading

NEAR = 0.5  # of the largest value: local peaks that have a window of their own
MOST = 12  # of them: vibrations have thousands
COARSE = 2  # every second output: what a peak is with these tells how well all of them resolve it
NOISE = 1e-6  # of a peak: a valley that is less deep lies between no two peaks


@dataclass(frozen=True)
class Peak(Goal):
    """The largest absolute value of a history, of any of its columns; of vectors their length."""

    text: str
    name: str

    @property
    def analysis(self) -> str:  # type: ignore[override]
        """The first part of the name."""
        return self.name.replace("/", ".").partition(".")[0]

    def read(self, results: Results) -> Reading:
        """The value, when it is reached, and in which column."""
        history = self._history(results)
        k, column = _largest(self._seen(history).values)
        sign = -1.0 if history.values[k, column] < 0.0 else 1.0
        _, time = top_at(history.time, history.values[:, column], k)
        edge: Literal["", "first", "last"] = "first" if k == 0 else "last" if k == history.time.size - 1 else ""
        value, coarse = (sign * history.at(time, column, every) for every in (1, COARSE))
        return Reading(value, history.unit, time, edge, column, sign, coarse=coarse)

    def follow(self, results: Results, nominal: Reading) -> Followed:
        """At the time, in the column and with the sign of the `nominal` peak."""
        history = self._history(results)
        time = {"first": history.time[0], "last": history.time[-1]}.get(nominal.edge, nominal.time)
        if not history.time[0] <= time <= history.time[-1]:
            return Followed(float("nan"), f"the run ends at t = {history.time[-1]:g} s")
        value, coarse = (nominal.sign * history.at(float(time), nominal.column, every) for every in (1, COARSE))
        return Followed(value, _overtaken(self._seen(history), nominal, float(time), value), coarse)

    def _seen(self, history: History) -> History:
        """What the largest value is sought in."""
        return history

    def _history(self, results: Results) -> History:
        return read_history(results, self.name, f'"{self.text}"')


@dataclass(frozen=True)
class Window:
    """Outputs of one column after the time `first` and up to `last`, s."""

    column: int
    first: float
    last: float

    def mask(self, history: History) -> Array:
        """(T, columns) 1 within, 0 elsewhere."""
        of_column = np.arange(history.values.shape[1]) == self.column
        return np.outer((history.time > self.first) & (history.time <= self.last), of_column).astype(np.float64)


@dataclass(frozen=True)
class PartOfPeak(Peak):
    """The largest absolute value within a window, or with `outside` in what several windows leave; 0 of nothing."""

    windows: tuple[Window, ...] = ()
    outside: bool = False

    def follow(self, results: Results, nominal: Reading) -> Followed:
        """As of any peak; where there is nothing to follow, nothing."""
        return super().follow(results, nominal) if nominal.value else Followed(0.0)

    def _seen(self, history: History) -> History:
        mask = np.sum([window.mask(history) for window in self.windows], axis=0)
        return replace(history, values=history.values * (1.0 - mask if self.outside else mask))


def parts(peak: Peak, results: Results) -> tuple[Peak, ...]:
    """Windows of local peaks that are at least `NEAR` the largest, the `MOST` highest, and what they leave.

    The least values between two of them part their windows, so that each local peak may move within its own.
    """
    history = peak._history(results)
    size = np.abs(history.values)
    found = [(k, column) for column in range(size.shape[1]) for k in _local(size[:, column], NEAR * float(size.max()))]
    found = sorted(sorted(found, key=lambda one: -size[one])[:MOST], key=lambda one: (one[1], one[0]))
    if len(found) < 2:
        return (peak,)
    windows: list[Window] = []
    for column in dict.fromkeys(column for _, column in found):
        places = [k for k, of in found if of == column]
        valleys = [a + int(np.argmin(size[a : b + 1, column])) for a, b in pairwise(places)]
        ends = [-np.inf, *(float(history.time[k]) for k in valleys), np.inf]
        windows += [Window(column, first, last) for first, last in pairwise(ends)]
    inner = tuple(PartOfPeak(peak.text, peak.name, (window,)) for window in windows)
    whole = {window.column for window in windows} == set(range(size.shape[1]))
    return inner if whole else (*inner, PartOfPeak(peak.text, peak.name, tuple(windows), outside=True))


def _local(size: Array, least: float) -> list[int]:
    """Outputs (T,) where a value of at least `least` > 0 is not below those beside it; of equal ones the first."""
    padded = np.concatenate([[-np.inf], size, [-np.inf]])
    high = (padded[1:-1] > padded[:-2]) & (padded[1:-1] >= padded[2:]) & (size >= least) & (size > 0.0)
    return [int(k) for k in np.flatnonzero(high)]


def _largest(values: Array) -> tuple[int, int]:
    """Output and column of the largest absolute value, the first one."""
    k, column = np.unravel_index(int(np.argmax(np.abs(values))), values.shape)
    return int(k), int(column)


def _overtaken(history: History, nominal: Reading, time: float, value: float) -> str:
    """Where the largest value is, if that is another peak: in another column, of the other sign, or past a valley."""
    k, column = _largest(history.values)
    now = history.values[k, column]
    if abs(now) <= value * (1.0 + NOISE):
        return ""
    between = (history.time - time) * (history.time - history.time[k]) <= 0.0
    same = column == nominal.column and now * nominal.sign > 0.0
    if same and np.min(nominal.sign * history.values[between, column]) >= value * (1.0 - NOISE):
        return ""  # the same peak, which moves
    where = f", column {column}" if history.values.shape[1] > 1 else ""
    return f"{abs(now):.6g} at t = {history.time[k]:g} s{where}"
