"""What `ffrobot uncertainty` tells: tables, files with all numbers."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from rich.console import Console

from ..common.arrays import Array
from ..common.files import write_atomically
from ..present.tables import plain_table
from .statistics import LEVELS, Statistics
from .uncertainty import Band, Uncertainty

NAMES = tuple(f"{100 * level:g}%" for level in LEVELS)
LINEAR = 0.9  # of a variance: below, shares by regression are told to be few


def file_name(text: str) -> str:
    """Of a goal or a history, without what file names do not take."""
    return re.sub(r"\W+", "_", text).strip("_")


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
    """The goals, each key's part in them, and what there is to mind."""
    if found.goals:
        table = plain_table("goal", "unit", "middle", "mean", "deviation", *NAMES)
        for g, (goal, reading) in enumerate(zip(found.goals, found.readings, strict=True)):
            s = found.statistics
            pairs = [(s.mean[g], s.mean_error[g]), (s.deviation[g], s.deviation_error[g])]
            pairs += list(zip(s.quantiles[:, g], s.quantile_errors[:, g], strict=True))
            table.add_row(goal, reading.unit, f"{reading.value:.6g}", *(_with_error(*pair) for pair in pairs))
        console.print(table, highlight=False)
        console.print()
        _print_parts(found, console)
    if found.bands:
        table = plain_table("history", "unit", "deviation, at most", "at t = (s)", "widest 5 % to 95 %", "at t = (s)")
        for band in found.bands:
            width = band.statistics.quantiles[-1] - band.statistics.quantiles[0]
            cells: list[str] = []
            for values in (band.statistics.deviation, width):
                k = int(np.argmax(values))
                cells += [f"{values[k]:.4g}", f"{band.time[k]:g}"]
            table.add_row(band.name, band.unit, *cells)
        console.print(table, highlight=False)
        console.print()
    for line in _remarks(found):
        console.print(line, soft_wrap=True, markup=False, highlight=False)


def _print_parts(found: Uncertainty, console: Console) -> None:
    """Shares of the variance, the largest first; Sobol indices where there are some."""
    for g, goal in enumerate(found.goals):
        console.print(f"{goal}:", soft_wrap=True, markup=False, highlight=False)
        headers = ("alone", "with others") if found.indices else ("share of the variance",)
        table = plain_table("key", "spread", *headers)
        by = found.indices.total[g] if found.indices else found.shares[g]
        for k in np.argsort(-np.nan_to_num(by)):
            one = found.spreads[k]
            cells = [f"{100.0 * found.shares[g, k]:.1f} %"]
            if i := found.indices:
                cells = [
                    _with_error(i.first[g, k], i.first_error[g, k]),
                    _with_error(i.total[g, k], i.total_error[g, k]),
                ]
            table.add_row(".".join(one.key), one.text.partition("=")[2], *cells)
        console.print(table, highlight=False)
        console.print()


def _remarks(found: Uncertainty) -> Iterator[str]:
    for goal, explained in zip(found.goals, found.explained, strict=True):
        if explained < LINEAR and found.indices is None:
            yield (
                f"note       {goal}: a linear function of the keys makes {100.0 * explained:.0f} % of the variance:"
                " --indices tells what each does, alone and with others"
            )
    yield from (f"note       {text}" for text in found.notes)
    if failed := len(found.failures):
        yield f"failed     {failed} of {found.runs} runs, left out: {found.failures[0]}"
    how = "± the standard error of as many independent samples: the mean of a Latin hypercube is better"
    if found.method == "gradients":
        how = "linear between runs one standard deviation to both sides; ± the difference that curvature makes"
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
    ]


def _numbers(s: Statistics, k: int) -> list[float]:
    pairs: list[Array] = [s.mean, s.mean_error, s.deviation, s.deviation_error]
    quantiles = zip(s.quantiles, s.quantile_errors, strict=True)
    return [float(one[k]) for one in (*pairs, *(value for pair in quantiles for value in pair))]


def _write(path: Path, columns: Sequence[str], rows: Iterator[list[object]]) -> None:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows(rows)
    write_atomically(path, text.getvalue().encode(), "table of uncertainties", ours=True)


def _with_error(value: float, error: float) -> str:
    return "" if np.isnan(value) else f"{value:.5g} ± {error:.1g}"
