"""Derivatives as they were found: arrays, a table and a tornado diagram for each goal, a file with all numbers."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..common.arrays import Array, as_floats
from ..pictures.studies.diagrams import Bars, Series
from .derivatives import Entry
from .finding import CsvFile, Finding, Section, file_name, numbers
from .readings import Reading

COLUMNS = (
    "goal", "value", "unit", "time", "key", "key_value", "derivative", "error", "percent_per_percent", "method", "step",
    "notes",
)  # fmt: skip
HEADING = ("key", "value", "% per %", "derivative", "error", "by")
HOW = {
    "repeated steps": "repeated steps: differences of runs with the same time steps",
    "differences": "differences: central, extrapolated",
    "exact": "exact: by modes, without runs",
}
ERRORS = "errors: by differences of lower order or of all keys at once, noise, and the tolerance of reused time steps"


@dataclass(frozen=True)
class Sensitivity(Finding):
    """Derivatives of g responses by k keys.

    Attributes:
        scene: its file.
        goals, readings: the responses, and their values in the scene.
        keys: with dots; `values` (k,) are theirs in the scene.
        entries: the derivatives, [response][key].
        failures: designs that failed, in words.
        tolerance: largest tolerance of the runs; `runs` is their number.
        table: the file of all runs; None if they were not kept.
    """

    name = "sensitivity"
    title = "What matters"

    scene: Path
    goals: tuple[str, ...]
    readings: tuple[Reading, ...]
    keys: tuple[str, ...]
    values: Array
    entries: tuple[tuple[Entry, ...], ...]
    failures: tuple[str, ...]
    tolerance: float
    runs: int
    table: Path | None

    @property
    def value(self) -> Array:
        """(g,) the goals."""
        return np.array([reading.value for reading in self.readings])

    @property
    def derivative(self) -> Array:
        """(g, k) ∂goal/∂key, SI units; NaN where there is none."""
        return np.array([[entry.derivative for entry in row] for row in self.entries])

    @property
    def error(self) -> Array:
        """(g, k) estimated error of the derivatives."""
        return np.array([[entry.error for entry in row] for row in self.entries])

    @property
    def logarithmic(self) -> Array:
        """(g, k) percent of the goal per percent of the key, θ/F ∂F/∂θ; NaN where F is 0."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return as_floats(np.where(self.value[:, None] == 0.0, np.nan, self.derivative * self._scale()))

    def _scale(self) -> Array:
        return self.values[None, :] / self.value[:, None]

    def ranked(self, g: int) -> list[int]:
        """Keys by number, the largest percent per percent of goal g first; those without one by their derivative."""
        sizes = [np.nan_to_num(np.abs(of[g])) for of in (self.logarithmic, self.derivative)]
        return sorted(range(len(self.keys)), key=lambda k: (-sizes[0][k], -sizes[1][k]))

    def headline(self) -> str:
        """The key that matters most for each goal."""
        return "; ".join(f"{goal}: {self.keys[self.ranked(g)[0]]} matters most" for g, goal in enumerate(self.goals))

    def sections(self) -> Iterator[Section]:
        """A table for each goal, the key that matters most first."""
        for g, (goal, reading) in enumerate(zip(self.goals, self.readings, strict=True)):
            rows = [self._row(g, k) for k in self.ranked(g)]
            yield Section(HEADING, rows, line=f"{goal}: {_reading(reading)}", of=goal)

    def _row(self, g: int, k: int) -> tuple[str, ...]:
        one = self.entries[g][k]
        return (
            self.keys[k], f"{self.values[k]:.6g}", _number(self.logarithmic[g, k], "+.5f"),
            _number(one.derivative, ".8g"), _number(one.error, ".1e"), one.method,
        )  # fmt: skip

    def csv_files(self) -> Iterator[CsvFile]:
        """One line for each goal and key."""
        yield CsvFile("sensitivity.csv", "table of sensitivities", COLUMNS, self._numbers())

    def _numbers(self) -> Iterator[list[object]]:
        for g, (goal, reading) in enumerate(zip(self.goals, self.readings, strict=True)):
            time = "" if np.isnan(reading.time) else reading.time
            for k, (key, value) in enumerate(zip(self.keys, self.values, strict=True)):
                one = self.entries[g][k]
                yield [
                    goal, reading.value, reading.unit, time, key, float(value), one.derivative, one.error,
                    self.logarithmic[g, k], one.method, one.step, "; ".join(one.notes),
                ]  # fmt: skip

    def diagrams(self) -> list[Bars]:
        """A tornado for each goal."""
        return [self._tornado(g) for g in range(len(self.goals))]

    def _tornado(self, g: int) -> Bars:
        """Percent of goal g per percent of each key, the largest on top; keys without a number are left out."""
        known = [k for k in self.ranked(g) if np.isfinite(self.logarithmic[g, k])]
        reading = self.readings[g]
        return Bars(
            name=f"tornado_{file_name(self.goals[g])}",
            title=f"{self.goals[g]}: {reading.value:.5g} {reading.unit}".rstrip(),
            x_label="change of the response (%) with +1 % of the parameter",
            labels=tuple(self.keys[k] for k in known),
            series=(Series(values=numbers(self.logarithmic[g, known])),),
            signed=True,
        )

    def remarks(self) -> Iterator[str]:
        """What to mind about the numbers, and how they came about."""
        for goal, row in zip(self.goals, self.entries, strict=True):
            for key, one in zip(self.keys, row, strict=True):
                yield from (f"note       {goal} by {key}: {text}" for text in one.notes)
        if failed := len(self.failures):
            yield f"failed     {failed} of {self.runs} runs, left out: {self.failures[0]}" + (
                f", and {failed - 1} more in the table of runs" if failed > 1 else ""
            )
        methods = {one.method for row in self.entries for one in row}
        texts = [words for method, words in HOW.items() if method in methods]
        yield (
            f"how        {self.runs} run{'s' if self.runs > 1 else ''} with a tolerance of at most {self.tolerance:g};"
            f" {'; '.join([*texts, ERRORS])}"
        )


def _reading(reading: Reading) -> str:
    when = "" if np.isnan(reading.time) else f" at t = {reading.time:g} s"
    return f"{reading.value:.8g}{' ' if reading.unit else ''}{reading.unit}{when}"


def _number(value: float, form: str) -> str:
    return "" if np.isnan(value) else format(value, form)
