"""Derivatives as they were found: arrays, a table for each goal with notes, a file with all numbers."""

from __future__ import annotations

import io
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.console import Console

from ..common.arrays import Array, as_floats
from ..common.files import write_atomically
from ..common.tables import TableWriter
from ..present.tables import plain_table
from .derivatives import Entry
from .readings import Reading

COLUMNS = (
    "goal", "value", "unit", "time", "key", "key_value", "derivative", "error", "percent_per_percent", "method", "step",
    "notes",
)  # fmt: skip


HOW = {
    "repeated steps": "repeated steps: differences of runs with the same time steps",
    "differences": "differences: central, extrapolated",
    "exact": "exact: by modes, without runs",
}
ERRORS = "errors: by differences of lower order or of all keys at once, noise, and the tolerance of reused time steps"


@dataclass(frozen=True)
class Sensitivity:
    """Derivatives of g goals by k keys.

    Attributes:
        scene: its file.
        goals, readings: what was asked for, and what it is at the scene's own values.
        keys: with dots; `values` (k,) in the scene.
        entries: [goal][key].
        failures: designs that failed, in words.
        tolerance: of the runs, at most; they are `runs` in all.
        table: the file of all runs; None where they were not kept.
    """

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

    def __str__(self) -> str:
        console = Console(file=io.StringIO(), width=120)
        print_sensitivity(self, console)
        assert isinstance(console.file, io.StringIO)
        return console.file.getvalue()


def write_sensitivity(found: Sensitivity, path: Path) -> None:
    """One line for each goal and key, as CSV."""
    text = io.StringIO()
    writer = TableWriter(text)
    writer.writerow(COLUMNS)
    for g, (goal, reading) in enumerate(zip(found.goals, found.readings, strict=True)):
        for k, (key, value) in enumerate(zip(found.keys, found.values, strict=True)):
            one = found.entries[g][k]
            time = "" if np.isnan(reading.time) else reading.time
            writer.writerow([
                goal, reading.value, reading.unit, time, key, float(value), one.derivative, one.error,
                found.logarithmic[g, k], one.method, one.step, "; ".join(one.notes),
            ])  # fmt: skip
    write_atomically(path, text.getvalue().encode(), "table of sensitivities", ours=True)


def print_sensitivity(found: Sensitivity, console: Console) -> None:
    """A table for each goal, the key that matters most first; then what to mind."""
    for g, (goal, reading) in enumerate(zip(found.goals, found.readings, strict=True)):
        console.print(f"{goal}: {_reading(reading)}", soft_wrap=True, markup=False, highlight=False)
        table = plain_table("key", "value", "% per %", "derivative", "error", "by")
        for k in ranked(found, g):
            one = found.entries[g][k]
            table.add_row(
                found.keys[k], f"{found.values[k]:.6g}", _number(found.logarithmic[g, k], "+.5f"),
                _number(one.derivative, ".8g"), _number(one.error, ".1e"), one.method,
            )  # fmt: skip
        console.print(table, highlight=False)
        console.print()
    for line in remarks(found):
        console.print(line, soft_wrap=True, markup=False, highlight=False)


def ranked(found: Sensitivity, g: int) -> list[int]:
    """Keys by number, the largest percent per percent of goal g first; those without one by their derivative."""
    logarithmic, derivative = np.abs(found.logarithmic[g]), np.abs(found.derivative[g])
    return sorted(range(len(found.keys)), key=lambda k: (-np.nan_to_num(logarithmic[k]), -np.nan_to_num(derivative[k])))


def remarks(found: Sensitivity) -> Iterator[str]:
    """What to mind about the numbers, and how they came about."""
    for goal, row in zip(found.goals, found.entries, strict=True):
        for key, one in zip(found.keys, row, strict=True):
            yield from (f"note       {goal} by {key}: {text}" for text in one.notes)
    if failed := len(found.failures):
        yield f"failed     {failed} of {found.runs} runs, left out: {found.failures[0]}" + (
            f", and {failed - 1} more in the table of runs" if failed > 1 else ""
        )
    methods = {one.method for row in found.entries for one in row}
    texts = [words for method, words in HOW.items() if method in methods]
    yield (
        f"how        {found.runs} run{'s' if found.runs > 1 else ''} with a tolerance of at most {found.tolerance:g};"
        f" {'; '.join([*texts, ERRORS])}"
    )


def _reading(reading: Reading) -> str:
    when = "" if np.isnan(reading.time) else f" at t = {reading.time:g} s"
    return f"{reading.value:.8g}{' ' if reading.unit else ''}{reading.unit}{when}"


def _number(value: float, form: str) -> str:
    return "" if np.isnan(value) else format(value, form)
