"""What `ffrobot uncertainty` tells: tables, files with all numbers."""

from __future__ import annotations

import io
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from rich.console import Console

from ..common.arrays import Array
from ..common.files import write_atomically
from ..common.tables import TableWriter
from ..present.tables import print_table
from .readings import Reading
from .statistics import LEVELS, Statistics
from .study_parts import file_name
from .uncertainty import Band, Uncertainty

NAMES = tuple(f"{100 * level:g}%" for level in LEVELS)
ROUNDING = 1e-13  # of a goal: smaller deviations are none
UNCHANGED = "none of the keys changes it"
LINEAR = 0.9  # of a variance: below, shares by regression are told to be few


def write_uncertainty(found: Uncertainty, folder: Path) -> list[Path]:
    """`uncertainty.csv`, one line for each goal, and `band_HISTORY.csv`, one for each time; the files written."""
    written = []
    if found.goals:
        written.append(folder / "uncertainty.csv")
        _write(written[-1], _goal_columns(found), _goal_rows(found))
    for band in found.bands:
        written.append(folder / f"band_{file_name(band.name)}.csv")
        _write(written[-1], ("time", "nominal", *_columns()), _band_rows(band))
    return written


def print_uncertainty(found: Uncertainty, console: Console) -> None:
    """Each goal with what the keys do to it, the bands, and what there is to mind."""
    for g in range(len(found.goals)):
        console.print(goal_line(found.goals[g], found.readings[g]), soft_wrap=True, markup=False, highlight=False)
        for headings, rows in ((statistics_headings(), [statistics_row(found, g)]), parts(found, g)):
            print_table(console, headings, rows)
    if found.bands:
        print_table(console, BAND_HEADINGS, band_rows(found))
    for line in remarks(found):
        console.print(line, soft_wrap=True, markup=False, highlight=False)


def goal_line(goal: str, reading: Reading) -> str:
    """With all nominal values."""
    return f"{goal}: {reading.value:.6g} {reading.unit}".rstrip() + " all parameters at nominal values"


def statistics_headings() -> tuple[str, ...]:
    """Of the columns of `statistics_row`."""
    return ("mean", "deviation", *NAMES, "worst case")


def statistics_row(found: Uncertainty, g: int) -> tuple[str, ...]:
    """Of goal g, each with its error."""
    s = found.statistics
    pairs = [(s.mean[g], s.mean_error[g]), (s.deviation[g], s.deviation_error[g])]
    pairs += list(zip(s.quantiles[:, g], s.quantile_errors[:, g], strict=True))
    return (*(with_error(*pair) for pair in pairs), f"{s.lowest[g]:.5g} to {s.highest[g]:.5g}")


def parts(found: Uncertainty, g: int) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Headings and rows of the keys' shares of the variance of goal g, the largest first; Sobol indices where known."""
    rows = []
    for k in ranked(found, g):
        one = found.spreads[k]
        cells = [f"{100.0 * found.shares[g, k]:.1f} %"]
        if i := found.indices:
            cells = [with_error(i.first[g, k], i.first_error[g, k]), with_error(i.total[g, k], i.total_error[g, k])]
        rows.append((".".join(one.key), one.text.partition("=")[2], *cells))
    return ("key", "spread", *(("alone", "with others") if found.indices else ("share of the variance",))), rows


def ranked(found: Uncertainty, g: int) -> list[int]:
    """Keys by number, the one that matters most for goal g first."""
    by = found.indices.total[g] if found.indices else found.shares[g]
    return [int(k) for k in np.argsort(-np.nan_to_num(by), kind="stable")]


BAND_HEADINGS = ("history", "unit", "deviation, at most", "at t = (s)", "widest 5 % to 95 %", "at t = (s)")


def band_rows(found: Uncertainty) -> Iterator[tuple[str, ...]]:
    """Where each history is least sure."""
    for band in found.bands:
        width = band.statistics.quantiles[-1] - band.statistics.quantiles[0]
        cells: list[str] = []
        for values in (band.statistics.deviation, width):
            k = int(np.argmax(values))
            cells += [f"{values[k]:.4g}", f"{band.time[k]:g}"]
        yield (band.name, band.unit, *cells)


def remarks(found: Uncertainty) -> Iterator[str]:
    """What there is to mind, and how it was found."""
    deviations = found.statistics.deviation
    for goal, reading, explained, deviation in zip(
        found.goals, found.readings, found.explained, deviations, strict=True
    ):
        if deviation <= ROUNDING * abs(reading.value):
            yield f"note       {goal}: {UNCHANGED}"
        if explained < LINEAR and found.indices is None:
            yield (
                f"note       {goal}: a linear function of the keys makes {100.0 * explained:.0f} % of the variance:"
                " --indices computes the effect of each, alone and with others"
            )
    yield from (f"note       {text}" for text in found.notes)
    if failed := len(found.failures):
        yield f"failed     {failed} of {found.runs} runs, left out: {found.failures[0]}"
    how = (
        "± the standard error of as many independent samples: the mean of a Latin hypercube is better; worst case:"
        " the lowest and the highest sample"
    )
    if found.method == "gradients":
        how = (
            "linear between runs one standard deviation to both sides; ± the difference that curvature makes; worst"
            " case: all keys at the worse ends of their spreads, normal ones two deviations off"
        )
    yield f"how        {found.runs} runs; {how}"


def _goal_columns(found: Uncertainty) -> list[str]:
    keys = [".".join(one.key) for one in found.spreads]
    parts = [f"share {key}" for key in keys]
    if found.indices:
        parts += [f"{word} {key}" for word in ("first", "first_error", "total", "total_error") for key in keys]
    return ["goal", "unit", "middle", *_columns(), "linear", *parts]


def _goal_rows(found: Uncertainty) -> Iterator[list[object]]:
    for g, (goal, reading) in enumerate(zip(found.goals, found.readings, strict=True)):
        parts = list(found.shares[g])
        if i := found.indices:
            parts += [*i.first[g], *i.first_error[g], *i.total[g], *i.total_error[g]]
        yield [goal, reading.unit, reading.value, *_numbers(found.statistics, g), found.explained[g], *parts]


def _band_rows(band: Band) -> Iterator[list[object]]:
    for k, t in enumerate(band.time):
        yield [t, band.nominal[k], *_numbers(band.statistics, k)]


def _columns() -> list[str]:
    return [
        "mean",
        "mean_error",
        "deviation",
        "deviation_error",
        *(f"{name}{e}" for name in NAMES for e in ("", "_error")),
        "lowest",
        "highest",
    ]


def _numbers(s: Statistics, k: int) -> list[float]:
    pairs: list[Array] = [s.mean, s.mean_error, s.deviation, s.deviation_error]
    quantiles = zip(s.quantiles, s.quantile_errors, strict=True)
    return [float(one[k]) for one in (*pairs, *(value for pair in quantiles for value in pair), s.lowest, s.highest)]


def _write(path: Path, columns: Sequence[str], rows: Iterator[list[object]]) -> None:
    text = io.StringIO()
    writer = TableWriter(text)
    writer.writerow(columns)
    writer.writerows(rows)
    write_atomically(path, text.getvalue().encode(), "table of uncertainties", ours=True)


def with_error(value: float, error: float) -> str:
    """`0.17 ± 0.01`; nothing where there is no value."""
    return "" if np.isnan(value) else f"{value:.5g} ± {error:.1g}"
