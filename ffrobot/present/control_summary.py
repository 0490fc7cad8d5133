"""What a solve prints of linear models and placements."""

from __future__ import annotations

from collections.abc import Iterator

from rich.table import Table

from ..actuation.control.linear_analysis import LinearAnalysis
from ..run.solution import Solution

FREQUENCIES = 5  # that are listed


def linear_table(solution: Solution, table: Table) -> Table:
    """Frequencies and growth at every time; `table` has the columns of `LINEAR_COLUMNS`."""
    for name, linear in solution.linear.items():
        for model, modes in zip(linear.models, linear.modes, strict=True):
            vibrating = modes.frequency[modes.frequency > 0.0]
            table.add_row(
                name,
                f"{model.time:g}",
                f"{model.freedom}",
                ", ".join(f"{f:.4g}" for f in vibrating[:FREQUENCIES]),
                f"{modes.growth:.3g}" if modes.growth else "",
            )
    return table


LINEAR_COLUMNS = ("linear model", "t (s)", "freedom", "lowest frequencies (Hz)", "growth (1/s)")


def linear_lines(solution: Solution) -> Iterator[str]:
    """Zeros, modes that nothing moves or sees, and places of patches, a line each."""
    for name, linear in solution.linear.items():
        for pair, found in linear.zeros.items():
            half = len(pair) // 2
            transfer = f"{', '.join(pair[:half])} → {', '.join(pair[half:])}"
            worst = next((zeros for zeros in found if not zeros.minimum_phase), found[0])
            yield f"{name}: {transfer}: {worst.describe()}"
        yield from _lost(name, linear)
    for name, placed in solution.placements.items():
        yield f"{name}: centres at {', '.join(f'{x:.4g}' for x in placed.best.centers)} m"


PLACEMENT_COLUMNS = ("placement", "on", "by", "found", "evenly spread", "of sets")


def placement_table(solution: Solution, table: Table) -> Table:
    """The patches found against as many spread evenly: reach of modes, or the largest voltage of the path."""
    for name, placed in solution.placements.items():
        over_path = placed.wanted.criterion == "voltage"
        pair = placed.largest_voltage if over_path else (placed.best.value, placed.even.value)
        table.add_row(
            name,
            placed.wanted.body,
            "voltage" if over_path else f"{placed.wanted.measure} reach",
            *(f"{value:.4g}" + (" V" if over_path else "") for value in pair),
            f"{placed.sets}" + (" (evolution)" if placed.method == "evolution" else ""),
        )
    return table


def _lost(name: str, linear: LinearAnalysis) -> Iterator[str]:
    for verb, reaches in (
        ("no motor or patch moves", linear.controllable), ("no joint or point of it sees", linear.observable)
    ):  # fmt: skip
        for model, reach in zip(linear.models, reaches, strict=True):
            if reach.lost:
                yield f"{name}, t = {model.time:g} s: {verb} {', '.join(reach.lost)}"
