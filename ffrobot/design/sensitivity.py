"""Derivatives of responses by numbers of a scene and its links: `ffrobot sensitivity`.

If possible, runs reuse the time steps of the scene's own run (`mbs/fields/field_types.py`). The noise of differences is
then round-off, 1e-13 to 1e-11 of a response after thousands of steps and with new modes of links. Truncation grows with
the number of periods of vibrations. So every key takes three small steps of two sizes (`THREE`), which check each
other, and others where errors are above `derivatives.AIM`.

Otherwise every key takes steps h, h/2 and h/4 to both sides, with h one percent, in runs with a tighter tolerance than
the scene's. If errors above `AIM` fall with smaller steps, steps of a quarter follow, twice at most.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ..common.arrays import Array
from ..common.errors import InputError
from ..pictures.studies.study import Bars, Series
from ..sweep.files import number_at
from ..sweep.sweep import Key
from .derivatives import Base, Entry, Sample, entries, rough_keys
from .designs import Designs, Runs, changes_for, may_repeat, parse_key, repeated_steps
from .finding import CsvFile, Finding, TextTable, file_name, numbers
from .readings import Reading, Response
from .responses import parse_response

COLUMNS = (
    "response", "value", "unit", "time", "key", "key_value",
    "derivative", "error", "percent_per_percent", "method", "step", "notes",
)  # fmt: skip
HEADING = ("key", "value", "% per %", "derivative", "error", "by")
HOW = {
    "repeated steps": "repeated steps: differences of runs with the same time steps",
    "differences": "differences: central, extrapolated",
}
ERRORS = "errors: by differences of lower order, noise, and the tolerance of reused time steps"


@dataclass(frozen=True, kw_only=True)
class Sensitivity(Finding):
    """Derivatives of g responses with respect to k keys.

    Attributes:
        readings: values of the responses in the scene, by name.
        keys: names with dots; `values` (k,) are theirs in the scene, SI units.
        entries: derivatives, [response][key].
        tolerance: largest tolerance of the runs.
    """

    name = "sensitivity"
    title = "Sensitivities"

    readings: dict[str, Reading]
    keys: tuple[str, ...]
    values: Array
    entries: tuple[tuple[Entry, ...], ...]
    tolerance: float

    @property
    def shortfall(self) -> str | None:
        """Reason why there are no derivatives, or None."""
        return "no derivatives" if np.isnan(self.derivative).all() else None

    @property
    def value(self) -> Array:
        """Responses (g,) of the scene, SI units."""
        return np.array([reading.value for reading in self.readings.values()])

    @property
    def derivative(self) -> Array:
        """Derivatives (g, k) ∂response/∂key, SI units; NaN if unknown."""
        return np.array([[entry.derivative for entry in row] for row in self.entries])

    @property
    def error(self) -> Array:
        """Estimated errors (g, k) of the derivatives, SI units."""
        return np.array([[entry.error for entry in row] for row in self.entries])

    @property
    def logarithmic(self) -> Array:
        """Relative sensitivities (g, k), percent of response per percent of key, θ/F ∂F/∂θ; NaN where F is 0."""
        with np.errstate(divide="ignore", invalid="ignore"):
            ratios = self.values / self.value[:, None]
            return np.where(self.value[:, None] == 0.0, np.nan, self.derivative * ratios)

    def ranked(self, g: int) -> list[int]:
        """Return numbers of keys by decreasing influence on response g, in percent per percent, else by derivative."""
        sizes = [np.nan_to_num(np.abs(of[g])) for of in (self.logarithmic, self.derivative)]
        return sorted(range(len(self.keys)), key=lambda k: (-sizes[0][k], -sizes[1][k]))

    def headline(self) -> str:
        """The key with the largest influence on each response."""
        return "; ".join(
            f"{response}: {self.keys[self.ranked(g)[0]]} matters most" for g, response in enumerate(self.readings)
        )

    def sections(self) -> Iterator[TextTable]:
        """Tables, one for each response, the most influential key first."""
        for g, (response, reading) in enumerate(self.readings.items()):
            rows = []
            for k in self.ranked(g):
                one = self.entries[g][k]
                pairs = ((self.logarithmic[g, k], "+.5f"), (one.derivative, ".8g"), (one.error, ".1e"))
                cells = ("" if np.isnan(value) else format(value, form) for value, form in pairs)
                rows.append((self.keys[k], f"{self.values[k]:.6g}", *cells, one.method))
            when = "" if np.isnan(reading.time) else f" at t = {reading.time:g} s"
            yield TextTable(HEADING, rows, line=f"{response}: {reading.in_words(8)}{when}", of=response)

    def csv_files(self) -> Iterator[CsvFile]:
        """CSV tables with one line for each response and key."""
        rows: list[list[object]] = []
        for g, (response, reading) in enumerate(self.readings.items()):
            about = [response, reading.value, reading.unit, "" if np.isnan(reading.time) else reading.time]
            for k, one in enumerate(self.entries[g]):
                values = [float(self.values[k]), one.derivative, one.error, self.logarithmic[g, k]]
                rows.append([*about, self.keys[k], *values, one.method, one.step, "; ".join(one.notes)])
        yield CsvFile("sensitivity.csv", COLUMNS, rows)

    def diagrams(self) -> list[Bars]:
        """Tornado diagrams, one for each response: percent per percent of keys with a derivative, largest on top."""
        bars = []
        for g, (response, reading) in enumerate(self.readings.items()):
            known = [k for k in self.ranked(g) if np.isfinite(self.logarithmic[g, k])]
            bars.append(
                Bars(
                    name=f"tornado_{file_name(response)}",
                    title=f"{response}: {reading.in_words(5)}",
                    x_label="% per % of the parameter",
                    labels=tuple(self.keys[k] for k in known),
                    series=(Series(values=numbers(self.logarithmic[g, known])),),
                    signed=True,
                )
            )
        return bars

    def remarks(self) -> Iterator[str]:
        """Notes on the accuracy, failed runs, and the method."""
        for (response, reading), row in zip(self.readings.items(), self.entries, strict=True):
            if reading.remark:
                yield f"note       {response}: {reading.remark}"
            for key, one in zip(self.keys, row, strict=True):
                yield from (f"note       {response} by {key}: {text}" for text in one.notes)
        yield from self.failed()
        methods = {one.method for row in self.entries for one in row}
        texts = [words for method, words in HOW.items() if method in methods]
        yield (
            f"how        {self.runs} run{'s' if self.runs > 1 else ''} with a tolerance of at most {self.tolerance:g};"
            f" {'; '.join([*texts, ERRORS])}"
        )


THREE = (-1e-3, 1e-3, 2e-3)  # of the largest step: where runs take the same steps
OTHERS = ((1e-4, -1e-4, 4e-3, -4e-3), (1e-2, -1e-2))  # likewise, that follow where these are not good enough
BOTH_SIDES = (1.0, -1.0, 0.5, -0.5, 0.25, -0.25)  # likewise, where runs choose their own
FINER = ((0.125, -0.125, 0.0625, -0.0625), (0.03125, -0.03125, 0.015625, -0.015625))  # where these are too large
TOLERANCE = 1e-9  # of the runs, near round-off of forces in stiff links
TOLERANCE_REPEATED = 1e-7  # of runs with reused steps, whose noise does not depend on it


def find_sensitivity(
    runs: Runs, of: Sequence[str], to: Sequence[str], step: float, tolerance: float | None
) -> Sensitivity:
    """Return derivatives of responses `of` by keys `to`; arguments as of `ffrobot.sensitivity`."""
    responses = tuple(parse_response(text) for text in dict.fromkeys(of))
    keys = tuple(parse_key(text, "--to") for text in dict.fromkeys(to))
    if not responses or not keys:
        raise InputError("sensitivity: expected at least one response (--of) and one key (--to)")
    designs, base = _start(runs, responses, keys, step, tolerance)
    samples, wanted = list[Sample](), list(range(len(keys)))
    for parts in (THREE, *OTHERS) if base.repeats else ():
        samples += _beside(designs, base, samples, wanted, parts)
        wanted = rough_keys(base, samples, smaller=False)
    samples += _beside(designs, base, samples, wanted, BOTH_SIDES)
    for parts in () if base.repeats else FINER:
        samples += _beside(designs, base, samples, rough_keys(base, samples, smaller=True), parts)
    failures = tuple(
        f"{'.'.join(keys[one.k])} = {base.point[one.k] + one.offset:.6g}: {one.failure}"
        for one in samples
        if one.failure
    )
    return Sensitivity(
        scene=runs.path,
        readings={response.text: one for response, one in zip(responses, base.readings, strict=True)},
        keys=tuple(map(".".join, keys)),
        values=np.array(base.point),
        entries=entries(base, samples),
        failures=failures,
        tolerance=base.repeats or tolerance or TOLERANCE,
        runs=designs.count,
        table=designs.table,
    )


def _start(
    runs: Runs, responses: tuple[Response, ...], keys: tuple[Key, ...], step: float, tolerance: float | None
) -> tuple[Designs, Base]:
    """The base of derivatives at the scene's own values, and designs with other values.

    These reuse its time steps if they can; else runs have a tighter tolerance. Raises `InputError` for a key that may
    be neither larger nor smaller, such as a count.
    """
    point = tuple(number_at(runs.path, key, "--to") for key in keys)
    steps = tuple(step * (abs(value) or 1.0) for value in point)  # of keys that are 0, in their unit
    for repeats in (tolerance or TOLERANCE_REPEATED, 0.0) if may_repeat(keys) else (0.0,):
        fixed = changes_for(runs.path, responses, repeats or tolerance or TOLERANCE, keep_steps=repeats > 0.0)
        designs = Designs(runs, keys, point, fixed)
        with designs.run_first(point).results() as results:
            readings = tuple(response.read(results) for response in responses)
            again = repeated_steps(results) if repeats else None
        if again:
            break
    base = Base(responses, readings, keys, point, steps, repeats=repeats if again else 0.0, again=again or {})
    for k, key in enumerate(keys):
        sides = [base.moved(k, sign * steps[k]) for sign in (1.0, -1.0)]
        if point[k].is_integer() and (problem := designs.problem(*sides)):
            name = ".".join(key)
            raise InputError("--to: expected keys that may be a little larger or smaller", f"{name}:\n{problem}")
    return designs, base


def _beside(
    designs: Designs, base: Base, samples: Sequence[Sample], which: Sequence[int], parts: Sequence[float]
) -> list[Sample]:
    """Runs with one key changed by these parts of its largest step, where there are none of them yet."""
    taken = {(one.k, one.offset) for one in samples}
    places = [(k, part * base.steps[k]) for k in which for part in parts]
    new = [place for place in places if place not in taken]
    ran = designs.run([base.moved(k, offset) for k, offset in new], base.again)
    return [
        Sample(k, offset, design.follow(base.responses, base.readings), design.failure)
        for (k, offset), design in zip(new, ran, strict=True)
    ]
