"""How sure results are where keys are spread: `ffrobot uncertainty`, by samples or by gradients.

Samples are a Latin hypercube of the keys' distributions. With `indices` they are two of half the size, A and B, and for
every key A with that column from B: Sobol indices need no other runs. Gradients take two runs for each key, one
standard deviation to both sides; what these say of curvature is the estimate of the error.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from ..common.arrays import Array
from ..common.errors import InputError, SolveError
from ..common.libraries import scipy
from ..pictures.studies.study import Band, Bars, Diagram, Series, StudyTable
from .designs import Design, Designs, Point, Runs, changes_for, in_words
from .finding import CsvFile, Finding, TextTable, failed_runs, file_name, floats, numbers, with_unit
from .readings import History, Reading, Response, read_column
from .responses import parse_response
from .spreads import (
    NAMES,
    Indices,
    LinearSpread,
    Spread,
    SpreadStatistics,
    read_spreads,
    regression_shares,
    sobol_indices,
    spread_points,
    statistics,
)

LinearOrSampled = Literal["samples", "gradients"]
ROUND_OFF = 1e-13  # of a response: smaller deviations are none
UNCHANGED = "none of the keys changes it"
LINEAR = 0.9  # of a variance: below, a note says that shares by regression are small
BAND_HEADINGS = ("history", "unit", "deviation, at most", "at t = (s)", "widest 5 % to 95 %", "at t = (s)")
WORST = {"samples": "lowest and highest sample", "gradients": "keys at their worse ends (linear)"}


@dataclass(frozen=True)
class HistoryBand:
    """A history's statistics at `time` (T,), s; `nominal` (T,) with all keys at the middle of their spreads."""

    name: str
    unit: str
    time: Array
    nominal: Array
    statistics: SpreadStatistics


@dataclass(frozen=True)
class Uncertainty(Finding):
    """Statistics of g responses and some histories for k uncertain keys.

    Attributes:
        scene: its file.
        spreads: (k,) distributions of the keys.
        method: samples or gradients.
        responses, readings: (g,) the responses, and their values with all keys at nominal values.
        statistics: (g,) of the responses.
        bands: of the histories.
        shares: (g, k) shares of the variance by the linear part; `explained` (g,) is their sum, NaN by gradients.
        indices: Sobol indices, if requested.
        samples: (n, g) the responses, NaN for failed runs; (0, g) by gradients.
        failures: failed runs in words; `runs` is the number of all, `table` their file.
        notes: peaks between outputs; peaks that others exceed near the nominal values (by gradients).
    """

    name = "uncertainty"
    title = "Uncertainty"

    scene: Path
    spreads: tuple[Spread, ...]
    method: LinearOrSampled
    responses: tuple[str, ...]
    readings: tuple[Reading, ...]
    statistics: SpreadStatistics
    bands: tuple[HistoryBand, ...]
    shares: Array
    explained: Array
    indices: Indices | None
    samples: Array
    failures: tuple[str, ...]
    notes: tuple[str, ...]
    runs: int
    table: Path | None

    def headline(self) -> str:
        """Intervals of the responses, in one line."""
        texts = []
        for g, (response, reading) in enumerate(zip(self.responses, self.readings, strict=True)):
            low, _, high = self.statistics.quantiles[:, g]
            texts.append(
                f"{response}: {low:.5g} to {high:.5g} {reading.unit}".rstrip() + f" ({NAMES[0]} to {NAMES[-1]})"
            )
        return "; ".join([*texts, *(f"band of {band.name}" for band in self.bands)])

    def sections(self) -> Iterator[TextTable]:
        """Tables of each response with the influence of the keys, then the bands."""
        for g, (response, reading) in enumerate(zip(self.responses, self.readings, strict=True)):
            heading = (*self.statistics.named, "worst case")
            nominal = f"{response}: {reading.in_words()} with all parameters at nominal values"
            yield TextTable(heading, [self._statistics_row(g)], line=nominal)
            yield self._parts(g)
        if self.bands:
            yield TextTable(BAND_HEADINGS, self._band_rows())

    def report_tables(self) -> Iterator[StudyTable]:
        """The statistics of all responses in one table."""
        if self.responses:
            rows = [
                (response, reading.unit, f"{reading.value:.6g}", *self._statistics_row(g))
                for g, (response, reading) in enumerate(zip(self.responses, self.readings, strict=True))
            ]
            heading = ("response", "unit", "nominal", *self.statistics.named, "worst case")
            yield TextTable(heading, rows).for_report()
        yield from (self._parts(g).for_report() for g in range(len(self.responses)))
        if self.bands:
            yield TextTable(BAND_HEADINGS, self._band_rows()).for_report()

    def _statistics_row(self, g: int) -> tuple[str, ...]:
        s = self.statistics
        cells = (with_error(value[g], error[g]) for value, error in s.named.values())
        return (*cells, f"{s.lowest[g]:.5g} to {s.highest[g]:.5g}")

    def _parts(self, g: int) -> TextTable:
        """The keys' shares of the variance of response g, the largest first; Sobol indices where known."""
        rows = []
        for k in self.ranked(g):
            one = self.spreads[k]
            cells = [f"{100.0 * self.shares[g, k]:.1f} %"]
            if i := self.indices:
                pairs = ((i.first, i.first_error), (i.total, i.total_error))
                cells = [f"{with_error(100.0 * part[g, k], 100.0 * error[g, k])} %" for part, error in pairs]
            rows.append((".".join(one.key), one.text.partition("=")[2], *cells))
        parts = ("alone", "with others") if self.indices else ("share of the variance",)
        return TextTable(("key", "spread", *parts), rows, of=self.responses[g])

    def ranked(self, g: int) -> list[int]:
        """Key numbers by decreasing influence on response g."""
        by = self.indices.total[g] if self.indices else self.shares[g]
        return [int(k) for k in np.argsort(-np.nan_to_num(by), kind="stable")]

    def _band_rows(self) -> Iterator[tuple[str, ...]]:
        for band in self.bands:
            width = band.statistics.quantiles[-1] - band.statistics.quantiles[0]
            cells: list[str] = []
            for values in (band.statistics.deviation, width):
                k = int(np.argmax(values))
                cells += [f"{values[k]:.4g}", f"{band.time[k]:g}"]
            yield (band.name, band.unit, *cells)

    def remarks(self) -> Iterator[str]:
        """Notes on the accuracy, failed runs, and the method."""
        deviations = self.statistics.deviation
        for response, reading, explained, deviation in zip(
            self.responses, self.readings, self.explained, deviations, strict=True
        ):
            if deviation <= ROUND_OFF * abs(reading.value):
                yield f"note       {response}: {UNCHANGED}"
            if explained < LINEAR and self.indices is None:
                yield (
                    f"note       {response}: linear effects of keys make up {100 * explained:.0f} % of the variance:"
                    " --indices computes the effect of each, alone and with others"
                )
        yield from (f"note       {text}" for text in self.notes)
        yield from failed_runs(self.failures, self.runs)
        how = (
            "± the standard error of as many independent samples: the mean of a Latin hypercube is better; worst case:"
            " the lowest and the highest sample"
        )
        if self.method == "gradients":
            how = (
                "linear between runs one standard deviation to both sides; ± the difference that curvature makes; worst"
                " case: all keys at the worse ends of their spreads, normal ones two deviations off"
            )
        yield f"how        {self.runs} runs; {how}"

    def csv_files(self) -> Iterator[CsvFile]:
        """CSV tables with one line for each response, and for each time of a history."""
        if self.responses:
            yield CsvFile("uncertainty.csv", "table of uncertainties", self._response_columns(), self._response_rows())
        for band in self.bands:
            lines = ([t, band.nominal[k], *band.statistics.numbers(k)] for k, t in enumerate(band.time))
            columns = ("time", "nominal", *band.statistics.columns)
            yield CsvFile(f"band_{file_name(band.name)}.csv", "table of uncertainties", columns, lines)

    def _response_columns(self) -> list[str]:
        keys = [".".join(one.key) for one in self.spreads]
        parts = [f"share {key}" for key in keys]
        if self.indices:
            parts += [f"{word} {key}" for word in ("first", "first_error", "total", "total_error") for key in keys]
        return ["response", "unit", "middle", *self.statistics.columns, "linear", *parts]

    def _response_rows(self) -> Iterator[list[object]]:
        for g, (response, reading) in enumerate(zip(self.responses, self.readings, strict=True)):
            parts = list(self.shares[g])
            if i := self.indices:
                parts += [*i.first[g], *i.first_error[g], *i.total[g], *i.total_error[g]]
            yield [response, reading.unit, reading.value, *self.statistics.numbers(g), self.explained[g], *parts]

    def diagrams(self) -> list[Diagram]:
        """Diagrams of the ranking of keys for each response, and of the bands."""
        return [*(self._ranking(g) for g in range(len(self.responses))), *map(self._band, self.bands)]

    def _ranking(self, g: int) -> Bars:
        order = self.ranked(g)
        if i := self.indices:
            pairs = {"alone": (i.first, i.first_error), "with others": (i.total, i.total_error)}
            series = [
                Series(label=label, values=numbers(100.0 * value[g, order]), errors=floats(100.0 * error[g, order]))
                for label, (value, error) in pairs.items()
            ]
        else:
            series = [Series(values=numbers(100.0 * self.shares[g, order]))]
        return Bars(
            name=f"ranking_{file_name(self.responses[g])}",
            title=self.responses[g],
            x_label="Sobol index (%)" if self.indices else "share of the variance (%)",
            labels=tuple(".".join(self.spreads[k].key) for k in order),
            series=tuple(series),
        )

    def _band(self, band: HistoryBand) -> Band:
        low, median, high = band.statistics.quantiles
        return Band(
            name=f"band_{file_name(band.name)}", title=band.name,
            y_label=with_unit(band.name.rpartition(".")[2], band.unit),
            time=floats(band.time), nominal=floats(band.nominal), median=floats(median), low=floats(low),
            high=floats(high), lowest=floats(band.statistics.lowest), highest=floats(band.statistics.highest),
            band_label=f"{NAMES[0]} to {NAMES[-1]}", worst_label=WORST[self.method],
        )  # fmt: skip


def with_error(value: float, error: float) -> str:
    """Return `0.173 ± 0.01`: digits down to a tenth of the error, no more than five; empty if the value is NaN."""
    known = np.floor(np.log10(abs(value) / error)) + 2 if value and error > 0.0 else 5
    digits = ((value, int(np.clip(known, 1, 5))), (error, 1))
    return "" if np.isnan(value) else " ± ".join(f"{float(f'{one:.{count}g}'):g}" for one, count in digits)


TOLERANCE = 1e-8  # of runs for gradients, at most: differences of one standard deviation
FEWEST = 8  # samples for a quantile of 5 %


@dataclass(frozen=True)
class WholeHistory(Response):
    """A history as a whole."""

    text: str
    name: str

    def history(self, results_of: Design) -> History:
        """Return the history of a completed design. Raises `InputError` for several columns."""
        with results_of.results() as results:
            return read_column(results, self.text, "--of")


def find_uncertainty(
    runs: Runs, of: Sequence[str], spread: Sequence[str], samples: int, seed: int, by: LinearOrSampled, *, indices: bool
) -> Uncertainty:
    """Propagate distributions of keys: see `ffrobot.uncertainty`."""
    if by == "samples" and samples < FEWEST:
        raise InputError(f"uncertainty: expected at least {FEWEST} samples", samples)
    if by == "gradients" and indices:
        raise InputError("uncertainty: expected Sobol indices of samples", "--by gradients")
    names = list(dict.fromkeys(of))
    responses = tuple(parse_response(text) for text in names if not _is_history(text))
    curves = tuple(WholeHistory(text, text) for text in names if _is_history(text))
    spreads = read_spreads(runs.path, spread)
    if not names or not spreads:
        raise InputError("uncertainty: expected at least one response or history (--of) and one key (--spread)")
    study = _Study(runs, spreads, responses, curves, TOLERANCE if by == "gradients" else None)
    return study.by_gradients() if by == "gradients" else study.by_samples(samples, seed, indices=indices)


def _is_history(text: str) -> bool:
    return len(text.split()) == 1 and text.strip() != "mass"


class _Study:
    """Designs by the values of keys that are spread, and what responses and histories are with nominal values.

    Making it raises `InputError` for spreads that make scenes impossible, `SolveError` where the nominal scene fails.
    """

    def __init__(
        self,
        runs: Runs,
        spreads: tuple[Spread, ...],
        responses: tuple[Response, ...],
        curves: tuple[WholeHistory, ...],
        tolerance: float | None,
    ) -> None:
        self._path, self._spreads, self._responses, self._curves = runs.path, spreads, responses, curves
        self._point: Point = tuple(one.mean for one in spreads)
        fixed = changes_for(runs.path, (*responses, *curves), tolerance)
        self._designs = Designs(runs, [one.key for one in spreads], tuple(one.own for one in spreads), fixed)
        for k, one in enumerate(spreads):
            for end in one.ends:
                if problem := self._designs.problem(self._moved(k, end)):
                    raise InputError(
                        "--spread: expected spreads with which the scene makes sense", f"{one.text}:\n{problem}"
                    )
        middle = self._designs.run_first(self._point)
        self._readings = middle.read(responses)
        self._nominal = tuple(curve.history(middle) for curve in curves)
        self._failures: list[str] = []
        pairs = zip(responses, self._readings, strict=True)
        self._notes = {f"peak of {g.text}": f"{g.text}: {one.remark}" for g, one in pairs if one.remark}

    def by_samples(self, count: int, seed: int, *, indices: bool) -> Uncertainty:
        """Return statistics of `count` points of a Latin hypercube (McKay, Beckman & Conover 1979)."""
        k = len(self._spreads)
        if indices:
            both = scipy.stats.qmc.LatinHypercube(2 * k, optimization="random-cd", seed=seed).random(count // 2)
            a, b = both[:, :k], both[:, k:]
            mixed = [np.where(np.arange(k) == i, b, a) for i in range(k)]
            u = np.concatenate([a, b, *mixed])
        else:
            u = scipy.stats.qmc.LatinHypercube(k, optimization="random-cd", seed=seed).random(count)
        points = spread_points(self._spreads, u)
        designs = self._designs.run(points)
        values = np.array([self._read(design) for design in designs])
        n = 2 * (count // 2) if indices else count  # those of the mixed points are no Latin hypercube
        whole = np.isfinite(values[:n]).all(axis=1) & [design.completed for design in designs[:n]]
        if whole.sum() < FEWEST:
            raise SolveError(f"{self._path}: {n - whole.sum()} of {n} samples failed: {self._failures[0]}")
        shares, explained = regression_shares(np.array(points[:n])[whole], values[:n][whole])
        complete = [design for design, is_whole in zip(designs[:n], whole, strict=True) if is_whole]
        bands = self._bands(complete, lambda nominal, of_designs: statistics(of_designs))
        blocks = values.reshape(-1, count // 2, len(self._responses)) if indices else None
        return Uncertainty(
            method="samples",
            statistics=statistics(values[:n][whole]),
            bands=bands,
            shares=shares,
            explained=explained,
            indices=sobol_indices(blocks[0], blocks[1], blocks[2:], seed) if blocks is not None else None,
            samples=values[:n],
            runs=1 + len(points),
            **self._common(),
        )

    def by_gradients(self) -> Uncertainty:
        """Return statistics of the linear model; a quadratic one without products of keys estimates its errors."""
        sides = [(k, sign * one.deviation) for k, one in enumerate(self._spreads) for sign in (1.0, -1.0)]
        designs = self._designs.run([self._moved(k, self._point[k] + offset) for k, offset in sides])
        pairs = np.array([self._follow(design) for design in designs])
        if failed := next((one for one in designs if not one.completed), None):
            raise SolveError(
                f"{self._path}: {self._where(failed)}: {failed.failure}; gradients need all runs, samples do without"
                " some"
            )
        model = self._linear(np.array([one.value for one in self._readings]), pairs)
        return Uncertainty(
            method="gradients",
            statistics=model.statistics(),
            bands=self._bands(designs, lambda nominal, of_designs: self._linear(nominal, of_designs).statistics()),
            shares=model.shares,
            explained=np.full(len(self._responses), np.nan),
            indices=None,
            samples=np.zeros((0, len(self._responses))),
            runs=1 + len(sides),
            **self._common(),
        )

    def _common(self) -> dict[str, Any]:
        return {
            "scene": self._path,
            "spreads": self._spreads,
            "responses": tuple(response.text for response in self._responses),
            "readings": self._readings,
            "failures": tuple(self._failures),
            "notes": tuple(self._notes.values()),
            "table": self._designs.table,
        }

    def _linear(self, middle: Array, sides: Array) -> LinearSpread:
        return LinearSpread.through(self._spreads, middle, sides.reshape(len(self._spreads), 2, -1))

    def _moved(self, k: int, value: float) -> Point:
        return (*self._point[:k], value, *self._point[k + 1 :])

    def _read(self, design: Design) -> list[float]:
        """The responses, NaN where the design failed or does not have them."""
        failure = design.failure
        try:
            if not failure:
                return [one.value for one in design.read(self._responses)]
        except InputError as error:
            failure = str(error)
        self._failures.append(f"{self._where(design)}: {failure}")
        return [float("nan")] * len(self._responses)

    def _follow(self, design: Design) -> list[float]:
        """The responses beside the middle, peaks at their own times."""
        followed = design.follow(self._responses, self._readings)
        for response, one in zip(self._responses, followed, strict=False):
            if one.elsewhere:
                kink = f"{response.text}: a kink: with {self._where(design)} the largest value is {one.elsewhere}"
                self._notes.setdefault(response.text, f"{kink}; samples take it into account")
        return [one.value for one in followed] or [float("nan")] * len(self._responses)

    def _bands(
        self, designs: Sequence[Design], of: Callable[[Array, Array], SpreadStatistics]
    ) -> tuple[HistoryBand, ...]:
        """Statistics `of` each history: with nominal values (T,), and of the designs (n, T)."""
        bands = []
        for curve, nominal in zip(self._curves, self._nominal, strict=True):
            values, middle = np.array([self._values(curve, nominal, one) for one in designs]), nominal.values[:, 0]
            bands.append(HistoryBand(nominal.name, nominal.unit, nominal.time, middle, of(middle, values)))
        return tuple(bands)

    def _values(self, curve: WholeHistory, nominal: History, design: Design) -> Array:
        history, time = curve.history(design), nominal.time
        if history.time.shape != time.shape or not np.allclose(history.time, time, rtol=1e-9, atol=1e-12):
            raise InputError(
                f'--of: expected the same times of "{history.name}" in all runs', f"others: {self._where(design)}"
            )
        return history.values[:, 0]

    def _where(self, design: Design) -> str:
        return in_words((one.key for one in self._spreads), design.point)
