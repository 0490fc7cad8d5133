"""The study of sensitivities: a tornado diagram and a table for each goal."""

from __future__ import annotations

import numpy as np

from ..pictures.studies.diagrams import Bars, Series
from ..pictures.studies.study import Study, StudyTable
from .record import Sensitivity, ranked, remarks
from .study_parts import file_name, make_study, numbers, table


def sensitivity_study(found: Sensitivity) -> Study:
    """What matters most for each goal, in the headline."""
    most = [(goal, next(iter(ranked(found, g)))) for g, goal in enumerate(found.goals)]
    headline = "; ".join(f"{goal}: {found.keys[k]} matters most" for goal, k in most)
    goals = range(len(found.goals))
    return make_study(
        "sensitivity", "What matters", found.scene, headline, remarks(found),
        [_table(found, g) for g in goals], [tornado(found, g) for g in goals],
    )  # fmt: skip


def tornado(found: Sensitivity, g: int) -> Bars:
    """Percent of goal g per percent of each key, the largest on top; keys without a number are left out."""
    known = [k for k in ranked(found, g) if np.isfinite(found.logarithmic[g, k])]
    reading = found.readings[g]
    return Bars(
        name=f"tornado_{file_name(found.goals[g])}",
        title=f"{found.goals[g]}: {reading.value:.5g} {reading.unit}".rstrip(),
        x_label="change of the response (%) with +1 % of the parameter",
        labels=tuple(found.keys[k] for k in known),
        series=(Series(values=numbers(found.logarithmic[g, known])),),
        signed=True,
    )


def _table(found: Sensitivity, g: int) -> StudyTable:
    rows = []
    for k in ranked(found, g):
        one = found.entries[g][k]
        cells = (f"{found.logarithmic[g, k]:+.5f}", f"{one.derivative:.8g}", f"{one.error:.1e}")
        texts = ["" if "nan" in cell else cell for cell in cells]
        rows.append((found.keys[k], f"{found.values[k]:.6g}", *texts, one.method))
    return table((found.goals[g], "value", "% per %", "derivative", "error", "by"), rows)
