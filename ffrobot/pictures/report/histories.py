"""Time histories: the standard figures of every file, laid over each other where they show the same."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...common.arrays import Array
from ...results.file import Results
from ...results.verdict import ROUND_OFF
from ..figures.figure_file import Curve, FigureRecord
from ..figures.shared import curve_points, file_name, limit_curves, limits_of
from ..figures.standard import standard_figures
from ..markers import Target, targets
from .charts import DASHES, Chart, limit_style, shades, style
from .runs import Run, runs, sources


def history_charts(files: Sequence[Results]) -> list[Chart]:
    """Path errors, paths, angles, deflections, forces, moments, voltages and energies."""
    charts = {chart.name: chart for chart in _path_errors(files)}
    for number, (results, source) in enumerate(zip(files, sources(files), strict=True)):
        records = {record.name: record for record in standard_figures(results)}
        for record in records.values():
            if record.kind == "configurations" or not record.curves:  # the mechanism moves instead; no histories
                continue
            chart = charts.setdefault(record.name, _empty(record))
            for curve in record.curves:
                _add(chart, results, record, curve, source, DASHES[number % len(DASHES)])
            if record.joint is not None:
                _add_limits(chart, results, record, source)
    return list(charts.values())


FOLDS = (
    ("Paths", ("error_", "path_", "tip_error")),
    ("Motors and joints", ("coordinate_", "moment_", "torque_speed_", "reaction_", "force_")),
    ("Deflections", ("deflection_",)),
    ("Stresses", ("stress_",)),
    ("Patches", ("voltage_", "required_voltage_")),
)
"""Parts of the page that fold, by how names of their charts begin; the others come last."""


def folded(charts: Sequence[Chart]) -> list[tuple[str, list[Chart]]]:
    """Charts by the part of the page that they are in; parts without any are left out."""
    parts: dict[str, list[Chart]] = {title: [] for title in (*(title for title, _ in FOLDS), "Bodies and energies")}
    for chart in charts:
        fits = (title for title, starts in FOLDS if chart.name.startswith(starts))
        parts[next(fits, "Bodies and energies")].append(chart)
    return [(title, members) for title, members in parts.items() if members]


def _empty(record: FigureRecord) -> Chart:
    if record.kind == "path":
        return Chart(record.name, record.title, record.y_label or "y (m)", x_label="x (m)", equal_axes=True)
    return Chart(record.name, record.title, record.y_label, record.x_label, limits=record.limits)


def _add(chart: Chart, results: Results, record: FigureRecord, curve: Curve, source: str, dash: str) -> None:
    """Add what `curve` draws: one line, or a shade for each column of its dataset."""
    label = f"{source}: {curve.label}" if source else curve.label
    if record.kind == "path":
        values = results.data(curve.data)
        chart.add(label, values[:, 0], values[:, 1], **style(len(chart.traces)))
        return
    x, values = curve_points(results, curve, record.scale)
    if values.shape[1] == 1:
        chart.add(label, x, values[:, 0], **style(len(chart.traces)))
    else:
        for k, color in enumerate(shades(values.shape[1])):
            line = {"color": color, "width": 1, "dash": dash}
            chart.add(f"{label} {k + 1}", x, values[:, k], line=line)


def _add_limits(chart: Chart, results: Results, record: FigureRecord, source: str) -> None:
    """What the motor of the joint of a torque-speed diagram can do."""
    assert record.joint is not None
    points = [curve_points(results, curve, record.scale) for curve in record.curves]
    speed, moment = (max(float(abs(pair[i]).max()) for pair in points) for i in (0, 1))
    limits = limit_curves(limits_of(results, record.joint, [curve.data for curve in record.curves]), speed, moment)
    if len(limits):
        chart.add(f"{source}: limits" if source else "limits", *limits.T, line=limit_style())


def _path_errors(files: Sequence[Results]) -> list[Chart]:
    """Distance of every point with a trajectory from where it should be."""
    charts: dict[str, Chart] = {}
    for run in runs(files):
        time = run.results.time(run.analysis)
        for target in targets(run.results, run.analysis) if len(time) > 1 else ():
            name, title = target.trajectory, f"distance of {target.point} from its path"
            empty = Chart(file_name("error", name), title, "distance (mm)", includes=(0.0, 1e3 * ROUND_OFF))
            chart = charts.setdefault(name, empty)
            error = path_error(run, target)
            chart.add(run.label, time[: len(error)], 1e3 * error, **style(len(chart.traces)))
    return list(charts.values())


def path_error(run: Run, target: Target) -> Array:
    """Distance (T,) in m between a point and its target, in the components that the target has."""
    reached = run.results.data(f"{run.analysis}/points/{target.point}/position")[:, target.columns]
    distance: Array = np.linalg.norm(reached[: len(target.wanted)] - target.wanted, axis=1)
    return distance
