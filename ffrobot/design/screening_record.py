"""What a screening tells: tables, a file with all numbers, μ* against σ."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..common.arrays import Array
from ..pictures.studies.diagrams import Points
from .elementary_effects import Effects
from .finding import CsvFile, Finding, Section, failed_runs, file_name, floats, with_unit
from .readings import Reading
from .spreads import Spread
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
    title = "Which keys matter"

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
        """The key that matters most for each goal."""
        first = [".".join(self.spreads[self.ranked(g)[0]].key) for g in range(len(self.goals))]
        return "; ".join(f"{goal}: {key} matters most" for goal, key in zip(self.goals, first, strict=True))

    def sections(self) -> Iterator[Section]:
        """A table for each goal, the key that matters most first."""
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
        """One line for each goal and key."""
        yield CsvFile("screening.csv", "table of elementary effects", COLUMNS, self._numbers())

    def _numbers(self) -> Iterator[list[object]]:
        e = self.effects
        for g, (goal, reading) in enumerate(zip(self.goals, self.readings, strict=True)):
            for k, one in enumerate(self.spreads):
                values = [float(of[g, k]) for of in (e.mu_star, e.mu_star_error, e.sigma, e.mu)]
                yield [goal, reading.unit, reading.value, ".".join(one.key), *values, int(e.count[g, k])]

    def diagrams(self) -> list[Points]:
        """μ* against σ for each goal."""
        return [self._points(g) for g in range(len(self.goals))]

    def ranked(self, g: int) -> list[int]:
        """Keys by number, the largest μ* of goal g first."""
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
