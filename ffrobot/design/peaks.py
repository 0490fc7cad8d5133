"""Peaks of histories.

A peak belongs to a time and a column: its derivative by a parameter is that of the history there (envelope theorem,
Danskin 1966), as long as no other time overtakes it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from ..common.arrays import Array
from ..results.file import Results
from .histories import History, read_history
from .readings import Followed, Goal, Reading

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
        k, column = _largest(history.values)
        value = history.values[k, column]
        edge: Literal["", "first", "last"] = "first" if k == 0 else "last" if k == history.time.size - 1 else ""
        return Reading(
            float(abs(value)), history.unit, float(history.time[k]), edge, column, -1.0 if value < 0.0 else 1.0
        )

    def follow(self, results: Results, nominal: Reading) -> Followed:
        """At the time, in the column and with the sign of the `nominal` peak."""
        history = self._history(results)
        time = {"first": history.time[0], "last": history.time[-1]}.get(nominal.edge, nominal.time)
        if not history.time[0] <= time <= history.time[-1]:
            return Followed(float("nan"), f"the run ends at t = {history.time[-1]:g} s")
        value = nominal.sign * history.at(float(time), nominal.column)
        return Followed(value, _overtaken(history, nominal, float(time), value))

    def _history(self, results: Results) -> History:
        return read_history(results, self.name, f'"{self.text}"')


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
