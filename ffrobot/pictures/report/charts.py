"""Charts as data for Plotly's JavaScript; time histories of all files in common charts."""

from base64 import b64encode
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from html import escape
from itertools import pairwise
from os.path import abspath
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ...common.arrays import Array, Indices, NDArray
from ...results.file import Results
from ...results.verdict import ROUND_OFF
from ..figures.shared import Curve, FigureRecord, curve_points, file_name, motor_limits
from ..figures.standard import standard_figures
from ..motion import PointTarget, targets
from ..projection import COLORS, LIMIT


class AnalysisRun(NamedTuple):
    """One analysis of one results file; `source` names the file, empty where there is only one."""

    results: Results
    analysis: str
    source: str

    @property
    def label(self) -> str:
        """Return the unique name of the run on the page."""
        return f"{self.source}: {self.analysis}" if self.source else self.analysis


def labelled(files: Sequence[Results]) -> list[tuple[Results, str]]:
    """Return the files with labels: "" for one, names of their scenes, or the differing parts of paths."""
    names = [""] if len(files) == 1 else [results.name for results in files]
    if len(set(names)) < len(names):
        names = distinct_parts([results.path for results in files])
    return list(zip(files, names, strict=True))


def distinct_parts(paths: Sequence[Path]) -> list[str]:
    """Strip the common start and end of all paths: `c/beam/r.h5`, `c/solid/r.h5` give `beam`, `solid`."""
    parts = [Path(abspath(path)).parts for path in paths]  # without ".."
    shortest = min(len(p) for p in parts)
    start = next((k for k in range(shortest) if len({p[k] for p in parts}) > 1), shortest - 1)
    end = next((k for k in range(shortest - start) if len({p[-1 - k] for p in parts}) > 1), 0)
    labels = ["/".join(p[start : len(p) - end]) for p in parts]
    is_unique = len(set(labels)) == len(labels)  # the same file twice gets numbers
    return labels if is_unique else [f"{label} ({k + 1})" for k, label in enumerate(labels)]


def runs(files: Sequence[Results]) -> list[AnalysisRun]:
    """Return every analysis of every file, in order."""
    return [
        AnalysisRun(results, analysis, source) for results, source in labelled(files) for analysis in results.analyses
    ]


MAX_POINTS = 4000  # of a curve; more cannot be told apart on a screen

FAR = 10  # times the largest value of a chart: higher limits would flatten its curves
LIMIT_LINE = {"color": LIMIT, "dash": "dash", "width": 1.5}
DASHES = ("solid", "dash", "dashdot", "dot")
# Violet to green (viridis, its dark end brighter: dark pages), for series with an order.
SHADES = np.array([[165, 90, 200], [65, 115, 175], [33, 145, 140], [94, 201, 98]], dtype=float)


@dataclass
class Chart:
    """One diagram of the page."""

    name: str  # unique on the page; letters, digits, `_`
    # title, x_label, y_label: with units
    title: str
    y_label: str
    x_label: str = "time (s)"
    traces: list[dict[str, Any]] = field(default_factory=list)  # in Plotly's terms
    # horizontal lines; hidden until a click on their name if curves would be flat next to them
    limits: tuple[float, ...] = ()
    includes: tuple[float, ...] = ()  # values that the range of y contains
    equal_axes: bool = False  # one meter is as long on both
    top: float = field(default=0.0, init=False)  # largest |y| of visible curves

    def add(self, label: str, x: Array, y: Array, **style: Any) -> None:
        """Add a curve y (n,) over x (n,), in the units of the labels."""
        if "visible" not in style:
            self.top = max(self.top, float(np.nanmax(np.abs(y), initial=0.0)))
        mode = "lines" if len(y) > 1 else "markers"
        if mode == "lines":  # else Plotly leaves out points that it takes for straight: corners on smooth curves
            style["line"] = style.get("line", {}) | {"simplify": False}
        self.traces.append({"type": "scatter", "mode": mode, "name": plain(label), **_coordinates(x, y), **style})

    @property
    def layout(self) -> dict[str, Any]:
        """Layout of this chart in Plotly's terms."""
        texts = ", ".join(f"{limit:g}".replace("-", "−") for limit in self.limits)
        lines = [
            {
                "type": "line", "xref": "paper", "x0": 0, "x1": 1, "y0": limit, "y1": limit,
                "line": LIMIT_LINE, "showlegend": limit == self.limits[0], "name": f"limits {texts}",
                "legendgroup": "limits", "visible": True if abs(limit) < FAR * self.top else "legendonly",
            }
            for limit in self.limits
        ]  # fmt: skip
        y_title = {"text": plain(self.y_label), "standoff": 8}
        y_axis: dict[str, Any] = {"title": y_title, "automargin": True, "exponentformat": "power"}
        if self.includes:
            y_axis["autorangeoptions"] = {"include": list(self.includes)}
        if self.equal_axes:
            y_axis["scaleanchor"] = "x"
        return {
            "title": {"text": plain(self.title)},
            "xaxis": {"title": {"text": plain(self.x_label), "standoff": 5}},
            "yaxis": y_axis,
            "showlegend": len(self.traces) + len(lines) > 1,
            "shapes": lines,
        }


def plain(text: str) -> str:
    """Return `text` so that Plotly shows it literally, `<b>` too."""
    return escape(text, quote=False)


def encoded(values: NDArray[Any], kind: str = "f4") -> dict[str, str]:
    """Return values (n,) or (n, m), any unit, as Plotly's typed array: little-endian, base64; "f4" has 7 digits."""
    array = np.ascontiguousarray(values, dtype=f"<{kind}")
    entry = {"dtype": kind, "bdata": b64encode(array.tobytes()).decode("ascii")}
    if array.ndim == 2:
        entry["shape"] = ", ".join(map(str, array.shape))
    return entry


def style(k: int, color: int | None = None, part: int = 0) -> dict[str, Any]:
    """Return width, color and dashes of the k-th curve of a chart, such that no curve hides another.

    `color`: number of its run's color, by default k; `part`: number of earlier curves of this run.
    """
    turns, number = divmod(k if color is None else color, len(COLORS))
    dash = DASHES[(turns + part) % len(DASHES)]
    return {"line": {"color": COLORS[number], "dash": dash, "width": max(1.2, 3.6 * 0.75**k)}}


def shades(count: int) -> list[str]:
    """Return colors of `count` ordered series, dark to light."""
    where = np.linspace(0.0, len(SHADES) - 1.0, count)
    channels = [np.interp(where, np.arange(len(SHADES)), channel) for channel in SHADES.T]
    return [f"rgb({r:.0f},{g:.0f},{b:.0f})" for r, g, b in zip(*channels, strict=True)]


def kept_outputs(values: Array) -> Indices:
    """Return indices (k,) of `values` (T,), any unit, to draw: all, or the least and largest of each interval."""
    if len(values) <= MAX_POINTS or np.isnan(values).any():
        return np.arange(len(values))
    edges = np.linspace(0, len(values), MAX_POINTS // 2, dtype=np.intp)
    extremes = [(a + np.argmin(values[a:b]), a + np.argmax(values[a:b])) for a, b in pairwise(edges)]
    return np.unique(np.array([0, len(values) - 1, *np.ravel(extremes)], dtype=np.intp))


def _coordinates(x: Array, y: Array) -> dict[str, Any]:
    """X and y of a trace; equal steps take two numbers instead of an array."""
    kept = kept_outputs(y)
    steps = np.diff(x[kept])
    if len(steps) > 1 and np.all(np.abs(steps - steps[0]) <= 1e-9 * np.abs(x[-1] - x[0])):
        return {"x0": float(x[0]), "dx": float((x[-1] - x[0]) / len(steps)), "y": encoded(y[kept])}
    return {"x": encoded(x[kept], "f8"), "y": encoded(y[kept])}


def history_charts(files: Sequence[Results]) -> list[Chart]:
    """Return charts of path errors, paths, angles, deflections, forces, torques, voltages, energies of all analyses.

    Curves of a diverged analysis next to others are hidden until a click on their name.
    """
    charts = _path_errors(files)
    has_errors = bool(charts)
    looks = {(run.source, run.analysis): (k, _waiting(run)) for k, run in enumerate(runs(files))}
    together = len(looks) if len(files) > 1 else None
    for number, (results, source) in enumerate(labelled(files)):
        records = {record.name: record for record in standard_figures(results, together)}
        for record in records.values():
            if record.kind == "configurations" or not record.curves:  # the mechanism moves instead; no histories
                continue
            if record.name == "tip_error" and has_errors:
                continue  # the distance from the path again
            is_path = record.kind == "path"
            x_label = "x (m)" if is_path else record.x_label
            empty = Chart(record.name, record.title, record.y_label, x_label, limits=record.limits, equal_axes=is_path)
            chart = charts.setdefault(record.name, empty)
            for curve, look in _looks(record, source, looks, len(chart.traces)):
                label = f"{source}: {curve.label}" if source else curve.label
                if is_path:
                    chart.add(label, *results.data(curve.data)[:, :2].T, **look)
                    continue
                x, values = curve_points(results, curve, record.scale)
                if values.shape[1] == 1:
                    chart.add(label, x, values[:, 0], **look)
                    continue
                for k, color in enumerate(shades(values.shape[1])):
                    line = {"color": color, "width": 1, "dash": DASHES[number % len(DASHES)]}
                    chart.add(f"{label} {k + 1}", x, values[:, k], line=line)
            if record.joint is not None and len(limits := motor_limits(results, record)):
                chart.add(f"{source}: limits" if source else "limits", *limits.T, line=LIMIT_LINE)
    return list(charts.values())


FOLDS = (
    ("Paths", ("error_", "path_", "tip_error")),
    ("Motors and joints", ("coordinate_", "moment_", "torque_speed_", "reaction_", "force_")),
    ("Deflections", ("deflection_",)),
    ("Stresses", ("stress_",)),
    ("Patches", ("voltage_", "required_voltage_")),
    ("Bodies and energies", ("",)),
)
"""Parts of the page that fold, by how names of their charts begin; the last has all others."""


def folded(charts: Sequence[Chart]) -> list[tuple[str, list[Chart]]]:
    """Return charts by the title of their part of the page; empty parts are omitted."""
    parts: dict[str, list[Chart]] = {title: [] for title, _ in FOLDS}
    for chart in charts:
        parts[next(title for title, starts in FOLDS if chart.name.startswith(starts))].append(chart)
    return [(title, members) for title, members in parts.items() if members]


PRESCRIBED = {"color": "#8b95a3", "width": 4}


def _looks(
    record: FigureRecord, source: str, looks: dict[tuple[str, str], tuple[int, dict[str, str]]], before: int
) -> Iterator[tuple[Curve, dict[str, Any]]]:
    """Every curve with its style: a run has one color in all charts that compare runs, as in the mechanism.

    `looks` are colors and visibility by (source, analysis); `before`: curves that the chart has already.
    """
    names = [  # of analyses; a prescribed path, which all have, has none
        "" if curve.data.partition("[")[0].endswith("/target") else curve.data.partition("/")[0]
        for curve in record.curves
    ]
    is_one = len(set(names)) == 1
    parts: Counter[str] = Counter()
    for k, (curve, name) in enumerate(zip(record.curves, names, strict=True), before):
        if not name:
            yield curve, {"line": PRESCRIBED | {"dash": DASHES[parts[name] % len(DASHES)]}}
        else:
            color, waiting = looks[source, name]
            of_components = is_one and len(names) > 1
            yield curve, style(k) if of_components else style(k, color, parts[name]) | ({} if is_one else waiting)
        parts[name] += 1


def _waiting(run: AnalysisRun) -> dict[str, str]:
    return {"visible": "legendonly"} if run.results.attributes(run.analysis)["status"] == "diverged" else {}


def _path_errors(files: Sequence[Results]) -> dict[str, Chart]:
    """Distance of every point with a trajectory from where it should be, by the names of the charts."""
    charts: dict[str, Chart] = {}
    for k, run in enumerate(runs(files)):
        time = run.results.time(run.analysis)
        for target in targets(run.results, run.analysis) if len(time) > 1 else ():
            name, title = file_name("error", target.trajectory), f"distance of {target.point} from its path"
            chart = charts.setdefault(name, Chart(name, title, "distance (mm)", includes=(0.0, 1e3 * ROUND_OFF)))
            error = path_error(run.results, run.analysis, target)
            look = style(len(chart.traces), k) | (_waiting(run) if chart.traces else {})
            chart.add(run.label, time[: len(error)], 1e3 * error, **look)
    return charts


def path_error(results: Results, analysis: str, target: PointTarget) -> Array:
    """Return the distance (T,), m, of a point from its target at T outputs, in the components of the target."""
    reached = results.data(f"{analysis}/points/{target.point}/position")[:, target.columns]
    return np.linalg.norm(reached[: len(target.wanted)] - target.wanted, axis=1)
