"""The study of uncertainty: bands, and which key matters most."""

from __future__ import annotations

from ..pictures.studies import diagrams
from ..pictures.studies.diagrams import Bars, Series
from ..pictures.studies.study import Study
from .study_parts import file_name, floats, make_study, numbers, table, with_unit
from .uncertainty import Band, Uncertainty
from .uncertainty_record import (
    BAND_HEADINGS,
    NAMES,
    band_rows,
    parts,
    ranked,
    remarks,
    statistics_headings,
    statistics_row,
)

WORST = {"samples": "lowest and highest sample", "gradients": "keys at their worse ends (linear)"}


def uncertainty_study(found: Uncertainty) -> Study:
    """Statistics and ranking of goals, bands of histories."""
    goals = range(len(found.goals))
    tables = []
    if found.goals:
        rows = [
            (goal, reading.unit, f"{reading.value:.6g}", *statistics_row(found, g))
            for g, (goal, reading) in enumerate(zip(found.goals, found.readings, strict=True))
        ]
        tables.append(table(("goal", "unit", "nominal values", *statistics_headings()), rows))
    for g in goals:
        (key, *others), rows_of_keys = parts(found, g)
        tables.append(table((f"{found.goals[g]}: {key}", *others), rows_of_keys))
    if found.bands:
        tables.append(table(BAND_HEADINGS, band_rows(found)))
    return make_study(
        "uncertainty", "Uncertainty", found.scene, _headline(found), remarks(found), tables,
        [*(_ranking(found, g) for g in goals), *(_band(found, band) for band in found.bands)],
    )  # fmt: skip


def _headline(found: Uncertainty) -> str:
    """Between what goals are, most of the time."""
    texts = []
    for g, (goal, reading) in enumerate(zip(found.goals, found.readings, strict=True)):
        low, _, high = found.statistics.quantiles[:, g]
        texts.append(f"{goal}: {low:.5g} to {high:.5g} {reading.unit}".rstrip() + f" ({NAMES[0]} to {NAMES[-1]})")
    return "; ".join([*texts, *(f"band of {band.name}" for band in found.bands)])


def _ranking(found: Uncertainty, g: int) -> Bars:
    """Shares of the variance, or Sobol indices with their errors, in percent."""
    order = ranked(found, g)
    if i := found.indices:
        pairs = {"alone": (i.first, i.first_error), "with others": (i.total, i.total_error)}
        series = [
            Series(label=label, values=numbers(100.0 * value[g, order]), errors=floats(100.0 * error[g, order]))
            for label, (value, error) in pairs.items()
        ]
    else:
        series = [Series(values=numbers(100.0 * found.shares[g, order]))]
    return Bars(
        name=f"ranking_{file_name(found.goals[g])}", title=found.goals[g],
        x_label="Sobol index (%)" if found.indices else "share of the variance (%)",
        labels=tuple(".".join(found.spreads[k].key) for k in order), series=tuple(series),
    )  # fmt: skip


def _band(found: Uncertainty, band: Band) -> diagrams.Band:
    low, median, high = band.statistics.quantiles
    return diagrams.Band(
        name=f"band_{file_name(band.name)}", title=band.name,
        y_label=with_unit(band.name.rpartition(".")[2], band.unit),
        time=floats(band.time), nominal=floats(band.nominal), median=floats(median), low=floats(low), high=floats(high),
        lowest=floats(band.statistics.lowest), highest=floats(band.statistics.highest),
        band_label=f"{NAMES[0]} to {NAMES[-1]}", worst_label=WORST[found.method],
    )  # fmt: skip
