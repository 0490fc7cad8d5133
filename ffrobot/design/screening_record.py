"""What a screening tells: tables, a file with all numbers, its study."""

from __future__ import annotations

import io
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from rich.console import Console

from ..common.files import write_atomically
from ..common.tables import TableWriter
from ..pictures.studies.diagrams import Points
from ..pictures.studies.study import Study
from ..present.tables import print_table
from .screening import Screening
from .study_parts import file_name, floats, make_study, table, with_unit
from .uncertainty_record import UNCHANGED, goal_line, with_error

HEADINGS = ("key", "spread", "μ*", "σ", "μ")
COLUMNS = ("goal", "unit", "middle", "key", "mu_star", "mu_star_error", "sigma", "mu", "effects")


def print_screening(found: Screening, console: Console) -> None:
    """A table for each goal, the key that matters most first; what there is to mind."""
    for g, (goal, reading) in enumerate(zip(found.goals, found.readings, strict=True)):
        console.print(goal_line(goal, reading), soft_wrap=True, markup=False, highlight=False)
        print_table(console, HEADINGS, _rows(found, g))
    for line in remarks(found):
        console.print(line, soft_wrap=True, markup=False, highlight=False)


def remarks(found: Screening) -> Iterator[str]:
    """What there is to mind, and how it was found."""
    for goal, sizes in zip(found.goals, found.effects.mu_star, strict=True):
        if not np.nan_to_num(sizes).any():
            yield f"note       {goal}: {UNCHANGED}"
    for goal, counts in zip(found.goals, found.effects.count, strict=True):
        for one, count in zip(found.spreads, counts, strict=True):
            if count < len(found.values):
                left = f"{count} of {len(found.values)} effects, runs of the others failed"
                yield f"note       {goal} by {'.'.join(one.key)}: {left}"
    if failed := len(found.failures):
        yield f"failed     {failed} of {found.runs} runs, left out: {found.failures[0]}"
    yield (
        f"how        {found.runs} runs, {len(found.values)} trajectories (Morris); μ*: mean absolute change of the"
        " response over the whole range of a parameter, ± its standard error. σ: standard deviation, near 0 if the"
        " response is linear in the parameter, as large as μ* with nonlinearity or interaction; μ: signed mean"
    )


def write_screening(found: Screening, folder: Path) -> Path:
    """`screening.csv`, one line for each goal and key; the file written."""
    text, e = io.StringIO(), found.effects
    writer = TableWriter(text)
    writer.writerow(COLUMNS)
    for g, (goal, reading) in enumerate(zip(found.goals, found.readings, strict=True)):
        for k, one in enumerate(found.spreads):
            numbers = [float(values[g, k]) for values in (e.mu_star, e.mu_star_error, e.sigma, e.mu)]
            writer.writerow([goal, reading.unit, reading.value, ".".join(one.key), *numbers, int(e.count[g, k])])
    path = folder / "screening.csv"
    write_atomically(path, text.getvalue().encode(), "table of elementary effects", ours=True)
    return path


def screening_study(found: Screening) -> Study:
    """μ* against σ for each goal."""
    goals = range(len(found.goals))
    first = [".".join(found.spreads[ranked(found, g)[0]].key) for g in goals]
    headline = "; ".join(f"{goal}: {key} matters most" for goal, key in zip(found.goals, first, strict=True))
    tables = [table((f"{found.goals[g]}: key", *HEADINGS[1:]), _rows(found, g)) for g in goals]
    return make_study(
        "screening",
        "Which keys matter",
        found.scene,
        headline,
        remarks(found),
        tables,
        [_points(found, g) for g in goals],
    )


def ranked(found: Screening, g: int) -> list[int]:
    """Keys by number, the largest μ* of goal g first."""
    return [int(k) for k in np.argsort(-np.nan_to_num(found.effects.mu_star[g]), kind="stable")]


def _rows(found: Screening, g: int) -> list[tuple[str, ...]]:
    e = found.effects
    return [
        (
            ".".join(found.spreads[k].key),
            found.spreads[k].text.partition("=")[2],
            with_error(e.mu_star[g, k], e.mu_star_error[g, k]),
            *("" if np.isnan(value[g, k]) else f"{value[g, k]:.4g}" for value in (e.sigma, e.mu)),
        )
        for k in ranked(found, g)
    ]


def _points(found: Screening, g: int) -> Points:
    """Of keys that have effects."""
    e, unit = found.effects, found.readings[g].unit
    known = [k for k in ranked(found, g) if e.count[g, k]]
    return Points(
        name=f"screening_{file_name(found.goals[g])}", title=found.goals[g], x_label=with_unit("μ*", unit),
        y_label=with_unit("σ", unit), labels=tuple(".".join(found.spreads[k].key) for k in known),
        x=floats(e.mu_star[g, known]), y=floats(e.sigma[g, known]), x_errors=floats(e.mu_star_error[g, known]),
        named=True,
    )  # fmt: skip
