"""Result of `ffrobot uncertainty` as texts, tables and diagrams."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np

from ..common.arrays import Array
from ..pictures.studies.study import Band, Bars, Diagram, Series, StudyTable
from .finding import CsvFile, Finding, TextTable, file_name, floats, numbers, with_unit
from .readings import Reading
from .spreads import NAMES, Indices, Spread, SpreadStatistics

LinearOrSampled = Literal["samples", "gradients"]
ROUND_OFF = 1e-13  # of a response: smaller deviations are none
LINEAR = 0.9  # of a variance: below, a note says that shares by regression are small
BAND_HEADINGS = ("history", "unit", "deviation, at most", "at t = (s)", "widest 5 % to 95 %", "at t = (s)")
WORST = {"samples": "lowest and highest sample", "gradients": "keys at their worse ends (linear)"}


@dataclass(frozen=True)
class HistoryBand:
    """Statistics (T,) of a history at `time` (T,), s; `nominal` (T,), in `unit`: all keys at their mean values."""

    name: str
    unit: str
    time: Array
    nominal: Array
    statistics: SpreadStatistics


@dataclass(frozen=True, kw_only=True)
class Uncertainty(Finding):
    """Statistics of g responses and some histories for k uncertain keys.

    Attributes:
        spreads: (k,) distributions of the keys.
        method: samples or gradients.
        readings: values of the responses with all keys at their mean values, by name.
        statistics: (g,) of the responses, SI units.
        bands: bands of the histories.
        shares: (g, k) shares of the variance by the linear part, no unit; `explained` (g,): R², NaN by gradients.
        indices: Sobol indices, if requested.
        samples: (n, g) the responses, SI units, NaN for failed runs; (0, g) by gradients.
        notes: peaks between outputs; peaks that others exceed near the nominal values (by gradients).
    """

    name = "uncertainty"
    title = "Uncertainty"

    spreads: tuple[Spread, ...]
    method: LinearOrSampled
    readings: dict[str, Reading]
    statistics: SpreadStatistics
    bands: tuple[HistoryBand, ...]
    shares: Array
    explained: Array
    indices: Indices | None
    samples: Array
    notes: tuple[str, ...]

    def headline(self) -> str:
        """Intervals of the responses, in one line."""
        texts = []
        for g, (response, reading) in enumerate(self.readings.items()):
            low, _, high = self.statistics.quantiles[:, g]
            texts.append(
                f"{response}: {low:.5g} to {high:.5g} {reading.unit}".rstrip() + f" ({NAMES[0]} to {NAMES[-1]})"
            )
        return "; ".join([*texts, *(f"band of {band.name}" for band in self.bands)])

    def sections(self) -> Iterator[TextTable]:
        """Tables of each response with the influence of the keys, then the bands."""
        for g, (response, reading) in enumerate(self.readings.items()):
            heading = (*self.statistics.named, "worst case")
            nominal = f"{response}: {reading.in_words()} with all parameters at nominal values"
            yield TextTable(heading, [self._statistics_row(g)], line=nominal)
            yield self._parts(g)
        yield from self._bands()

    def report_tables(self) -> Iterator[StudyTable]:
        """The statistics of all responses in one table."""
        if self.readings:
            rows = [
                (response, reading.unit, f"{reading.value:.6g}", *self._statistics_row(g))
                for g, (response, reading) in enumerate(self.readings.items())
            ]
            heading = ("response", "unit", "nominal", *self.statistics.named, "worst case")
            yield TextTable(heading, rows).for_report()
        yield from (table.for_report() for table in (*map(self._parts, range(len(self.readings))), *self._bands()))

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
            if self.indices:
                pairs = (100.0 * np.array(pair)[:, g, k] for pair in self.indices.named.values())
                cells = [f"{with_error(*pair)} %" for pair in pairs]
            rows.append((".".join(one.key), one.text.partition("=")[2], *cells))
        parts = self.indices.named if self.indices else ("share of the variance",)
        return TextTable(("key", "spread", *parts), rows, of=[*self.readings][g])

    def ranked(self, g: int) -> list[int]:
        """Return numbers of keys by decreasing influence on response g."""
        by = self.indices.total[g] if self.indices else self.shares[g]
        return [int(k) for k in np.argsort(-np.nan_to_num(by), kind="stable")]

    def _bands(self) -> Iterator[TextTable]:
        rows = []
        for band in self.bands:
            cells, of = [band.name, band.unit], band.statistics
            for values in (of.deviation, of.quantiles[-1] - of.quantiles[0]):
                k = int(np.argmax(values))
                cells += [f"{values[k]:.4g}", f"{band.time[k]:g}"]
            rows.append(cells)
        if rows:
            yield TextTable(BAND_HEADINGS, rows)

    def remarks(self) -> Iterator[str]:
        """Notes on the accuracy, failed runs, and the method."""
        for g, (response, reading) in enumerate(self.readings.items()):
            if self.statistics.deviation[g] <= ROUND_OFF * abs(reading.value):
                yield f"note       {response}: none of the keys changes it"
            if (linear := self.explained[g]) < LINEAR and self.indices is None:
                yield (
                    f"note       {response}: linear effects of keys make up {100 * linear:.0f} % of the variance:"
                    " --indices computes the effect of each, alone and with others"
                )
        yield from (f"note       {text}" for text in self.notes)
        yield from self.failed()
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
        if self.readings:
            keys, parts = [".".join(one.key) for one in self.spreads], {"share": self.shares}
            if self.indices:
                parts |= vars(self.indices)
            of_keys = [f"{word} {key}" for word in parts for key in keys]
            columns = ["response", "unit", "middle", *self.statistics.columns, "linear", *of_keys]
            rows = [
                [response, reading.unit, reading.value, *self.statistics.numbers(g), self.explained[g],
                 *(value for part in parts.values() for value in part[g])]
                for g, (response, reading) in enumerate(self.readings.items())
            ]  # fmt: skip
            yield CsvFile("uncertainty.csv", columns, rows)
        for band in self.bands:
            lines = ([t, band.nominal[k], *band.statistics.numbers(k)] for k, t in enumerate(band.time))
            of_times = ["time", "nominal", *band.statistics.columns]
            yield CsvFile(f"band_{file_name(band.name)}.csv", of_times, lines)

    def diagrams(self) -> list[Diagram]:
        """Diagrams of the ranking of keys for each response, and of the bands."""
        pictures: list[Diagram] = []
        for g, response in enumerate(self.readings):
            order = self.ranked(g)
            series = [Series(values=numbers(100.0 * self.shares[g, order]))]
            if self.indices:
                series = [
                    Series(label=label, values=numbers(100.0 * value[g, order]), errors=floats(100.0 * error[g, order]))
                    for label, (value, error) in self.indices.named.items()
                ]
            bars = Bars(
                name=f"ranking_{file_name(response)}",
                title=response,
                x_label="Sobol index (%)" if self.indices else "share of the variance (%)",
                labels=tuple(".".join(self.spreads[k].key) for k in order),
                series=tuple(series),
            )
            pictures.append(bars)
        for one in self.bands:
            low, median, high = one.statistics.quantiles
            band = Band(
                name=f"band_{file_name(one.name)}", title=one.name,
                y_label=with_unit(one.name.rpartition(".")[2], one.unit),
                time=floats(one.time), nominal=floats(one.nominal), median=floats(median), low=floats(low),
                high=floats(high), lowest=floats(one.statistics.lowest), highest=floats(one.statistics.highest),
                band_label=f"{NAMES[0]} to {NAMES[-1]}", worst_label=WORST[self.method],
            )  # fmt: skip
            pictures.append(band)
        return pictures


def with_error(value: float, error: float) -> str:
    """Return `0.173 ± 0.01`: digits down to a tenth of the error, no more than five; empty if the value is NaN."""
    known = np.floor(np.log10(abs(value) / error)) + 2 if value and error > 0.0 else 5
    digits = ((value, int(np.clip(known, 1, 5))), (error, 1))
    return "" if np.isnan(value) else " ± ".join(f"{float(f'{one:.{count}g}'):g}" for one, count in digits)
