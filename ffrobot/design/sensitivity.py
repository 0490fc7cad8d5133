"""Derivatives of goals by numbers of a scene and its links: `ffrobot sensitivity`.

Where integrations can be repeated, runs beside the scene's own take its steps again (`mbs/fields/steps.py`). Their
differences have no noise but rounding, which many thousand steps, and modes of links that are computed anew, make 1e-13
to 1e-11 of a goal. Truncation grows with the number of periods that vibrations pass through. So the central pair of
each key is `WIDE`, or `NARROW` where that is too much, as two pairs tell that change all keys at once, with random
signs. The sum of what all pairs have found is then checked by that of the two that has their width. Where pairs err by
more than `AIM`, larger steps follow, as far as these are better.

Otherwise every key takes steps of three sizes to both sides, h, h/2 and h/4 with h one percent, in runs that are
integrated with a tighter tolerance than the scene's; `derivatives` has the extrapolation. Where errors are above `AIM`
and still fall with smaller steps, steps of a quarter follow, twice at most.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ..common.arrays import Array, as_floats
from ..common.errors import InputError
from ..pictures.studies.study import Bars, Series
from ..sweep.files import number_at
from ..sweep.sweep import Key
from .derivatives import AIM, SIZES, Base, Entry, Known, Sample, entries, rough_keys, values_of
from .designs import Designs, Point, Runs, changes_for, may_repeat, parse_key, repeated_steps
from .finding import CsvFile, Finding, Section, failed_runs, file_name, numbers
from .goals import parse_goal
from .readings import Goal, Reading

COLUMNS = (
    "goal", "value", "unit", "time", "key", "key_value", "derivative", "error", "percent_per_percent", "method", "step",
    "notes",
)  # fmt: skip
HEADING = ("key", "value", "% per %", "derivative", "error", "by")
HOW = {
    "repeated steps": "repeated steps: differences of runs with the same time steps",
    "differences": "differences: central, extrapolated",
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
            return as_floats(
                np.where(self.value[:, None] == 0.0, np.nan, self.derivative * (self.values / self.value[:, None]))
            )

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
            when = "" if np.isnan(reading.time) else f" at t = {reading.time:g} s"
            yield Section(HEADING, rows, line=f"{goal}: {reading.in_words(8)}{when}", of=goal)

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
        return Bars(
            name=f"tornado_{file_name(self.goals[g])}",
            title=f"{self.goals[g]}: {self.readings[g].in_words(5)}",
            x_label="change of the response (%) with +1 % of the parameter",
            labels=tuple(self.keys[k] for k in known),
            series=(Series(values=numbers(self.logarithmic[g, known])),),
            signed=True,
        )

    def remarks(self) -> Iterator[str]:
        """What to mind about the numbers, and how they came about."""
        for goal, reading, row in zip(self.goals, self.readings, self.entries, strict=True):
            if reading.remark:
                yield f"note       {goal}: {reading.remark}"
            for key, one in zip(self.keys, row, strict=True):
                yield from (f"note       {goal} by {key}: {text}" for text in one.notes)
        yield from failed_runs(self.failures, self.runs)
        methods = {one.method for row in self.entries for one in row}
        texts = [words for method, words in HOW.items() if method in methods]
        yield (
            f"how        {self.runs} run{'s' if self.runs > 1 else ''} with a tolerance of at most {self.tolerance:g};"
            f" {'; '.join([*texts, ERRORS])}"
        )


def _number(value: float, form: str) -> str:
    return "" if np.isnan(value) else format(value, form)


FINER = ((0.125, 0.0625), (0.03125, 0.015625))  # of those that follow where these are too large
TOLERANCE = 1e-9  # of the runs: below, rounding in forces of stiff links is not far
TOLERANCE_REPEATED = 1e-7  # of those that take the same steps: their noise is none of its


def find_sensitivity(
    runs: Runs, of: Sequence[str], to: Sequence[str], step: float, tolerance: float | None
) -> Sensitivity:
    """See `ffrobot.sensitivity`."""
    goals = tuple(parse_goal(text) for text in dict.fromkeys(of))
    keys = tuple(parse_key(text, "--to") for text in dict.fromkeys(to))
    if not goals or not keys:
        raise InputError("sensitivity: expected at least one response (--of) and one key (--to)")
    point = tuple(number_at(runs.path, key, "--to") for key in keys)
    steps = tuple(step * (abs(value) or 1.0) for value in point)  # of keys that are 0, in their unit
    designs, readings, repeats, again = _base(runs, goals, keys, point, tolerance)
    base = Base(goals, readings, keys, point, steps, repeats=repeats, again=again)
    _check_steps(designs, base)
    known = _all_known(designs, base)
    failures = tuple(
        f"{'.'.join(keys[one.k])} = {point[one.k] + one.offset:.6g}: {one.failure}"
        for one in known.samples
        if one.failure
    )
    return Sensitivity(
        runs.path, tuple(goal.text for goal in goals), base.readings, tuple(map(".".join, keys)), np.array(point),
        entries(base, known), failures, repeats or tolerance or TOLERANCE, designs.count, designs.table,
    )  # fmt: skip


def _base(
    runs: Runs, goals: Sequence[Goal], keys: Sequence[Key], point: Point, tolerance: float | None
) -> tuple[Designs, tuple[Reading, ...], float, Mapping[Key, Any]]:
    """Designs, the goals of the scene's own, the tolerance of runs that repeat its steps, 0 where they cannot, and how.

    That is by changes of their scenes.
    """
    if may_repeat(keys):
        repeats = tolerance or TOLERANCE_REPEATED
        designs = Designs(runs, keys, point, changes_for(runs.path, goals, repeats, keep_steps=True))
        readings, steps = _nominal(designs, goals, point)
        if steps:
            return designs, readings, repeats, steps
    designs = Designs(runs, keys, point, changes_for(runs.path, goals, tolerance or TOLERANCE))
    readings, _ = _nominal(designs, goals, point)
    return designs, readings, 0.0, {}


def _nominal(
    designs: Designs, goals: Sequence[Goal], point: Point
) -> tuple[tuple[Reading, ...], dict[Key, Any] | None]:
    """The goals of the scene's own design, and what has its steps taken again."""
    design = designs.run_first(point)
    with design.results() as results:
        readings = tuple(goal.read(results) for goal in goals)
        return readings, repeated_steps(results, readings)


def _check_steps(designs: Designs, base: Base) -> None:
    """Raise `InputError` for a key that may be neither larger nor smaller, such as a count, before any run."""
    for k, key in enumerate(base.keys):
        if not base.point[k].is_integer():
            continue
        if problem := designs.problem(base.moved(k, base.steps[k]), base.moved(k, -base.steps[k])):
            name = ".".join(key)
            raise InputError(f"--to: expected keys that may be a little larger or smaller, found {name}:\n{problem}")


def _all_known(designs: Designs, base: Base) -> Known:
    """All that derivatives need, with other steps where the first ones are not good enough."""
    known, wanted = Known(), list(range(len(base.keys)))
    if base.repeats:
        take_pairs(designs, base, known, wanted)
        for parts in OTHERS:
            wanted = rough_keys(base, known, smaller=False)
            known.samples += _beside(designs, base, known, wanted, parts)
        wanted = rough_keys(base, known, smaller=False)
    known.samples += _beside(designs, base, known, wanted, SIZES)
    for sizes in () if base.repeats else FINER:
        known.samples += _beside(designs, base, known, rough_keys(base, known, smaller=True), sizes)
    return known


def _beside(designs: Designs, base: Base, known: Known, which: Sequence[int], parts: Sequence[float]) -> list[Sample]:
    """Runs with one key changed by these parts of its largest step, to both sides, where there are none of them yet."""
    taken = {(one.k, one.offset) for one in known.samples}
    places = [(k, sign * part * base.steps[k]) for k in which for part in parts for sign in (1.0, -1.0)]
    return samples_at(designs, base, [place for place in places if place not in taken])


SHARED = 4  # keys, at least: fewer are as cheap with `THREE` runs each, which check themselves
THREE = (-0.01, 0.01, 0.02)  # of the largest step
WIDE, NARROW = 2e-3, 1e-4  # likewise
OTHERS = ((4e-4, 2e-3), (1e-2,))  # likewise, of pairs that follow where these are not good enough


def take_pairs(designs: Designs, base: Base, known: Known, wanted: Sequence[int]) -> None:
    """Of the keys `wanted`, by number; those that are 0 may only grow, maybe, and have three runs."""
    signs = np.random.default_rng(0).choice([-1.0, 1.0], len(wanted))
    signed = {k: float(sign) for k, sign in zip(wanted, signs, strict=True) if base.point[k] != 0.0}
    signed = signed if len(signed) >= SHARED else {}
    sums = _sums_of_differences(designs, base, signed) if signed else {}
    part = NARROW if signed and _is_too_wide(base, signed, sums) else WIDE
    offsets = {k: (-part, part) if k in signed else THREE for k in wanted}
    known.samples += samples_at(designs, base, [(k, x * base.steps[k]) for k in wanted for x in offsets[k]])
    failed = {k for k in signed if not all(one.goals for one in known.of_key(k))}
    second = [(k, 2.0 * one.offset) for k in failed for one in known.of_key(k) if one.goals]
    known.samples += samples_at(designs, base, second)
    if signed and not failed:
        known.pairs = {k: part * base.steps[k] for k in signed}
        found = sum(sign * known.central(k) for k, sign in signed.items())
        known.left = as_floats(np.abs(found - sums[part]))


def samples_at(designs: Designs, base: Base, places: Sequence[tuple[int, float]]) -> list[Sample]:
    """Runs with one key changed, by number of the key and offset."""
    found = designs.run([base.moved(k, offset) for k, offset in places], base.again)
    return [
        Sample(k, offset, design.follow(base.goals, base.readings), design.failure)
        for (k, offset), design in zip(places, found, strict=True)
    ]


def _sums_of_differences(designs: Designs, base: Base, signed: Mapping[int, float]) -> dict[float, Array]:
    """By width (g,) Σ ±(F(h_k) − F(−h_k))/2, of one pair with all keys changed at once, signs as in `signed`.

    In units of the steps h_k it is half as long as each of them: the third order is a quarter of theirs, the noise of
    the sum twice as large. NaN where a run fails.
    """
    shorter, widths = 0.5 / np.sqrt(len(signed)), (WIDE, NARROW)
    along = np.array([signed.get(k, 0.0) * step for k, step in enumerate(base.steps)])
    ends = [
        tuple(map(float, np.array(base.point) + side * shorter * part * along))
        for part in widths
        for side in (1.0, -1.0)
    ]
    found = designs.run(ends, base.again)
    values = [values_of(design.follow(base.goals, base.readings)) for design in found]
    pairs = zip(widths, values[::2], values[1::2], strict=True)
    return {part: as_floats(0.5 * (above - below) / shorter) for part, above, below in pairs}


def _is_too_wide(base: Base, signed: Mapping[int, float], sums: Mapping[float, Array]) -> bool:
    """Whether the sums of wide and narrow differences disagree by more than `AIM`."""
    k = next(iter(signed))
    sizes = np.abs([reading.value for reading in base.readings])
    relative = base.steps[k] / abs(base.point[k]) * np.where(sizes > 0.0, sizes, 1.0)
    wide, narrow = (sums[part] / (part * relative) for part in (WIDE, NARROW))  # percent per percent
    return bool(np.any(np.abs(wide - narrow) > AIM * np.maximum(1.0, np.abs(narrow))))
