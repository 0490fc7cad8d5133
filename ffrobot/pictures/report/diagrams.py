"""Diagrams of studies in Plotly's terms: tornados and rankings, parallel coordinates, convergence, bands, points."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from ...common.arrays import Array
from ..projection import COLORS
from ..studies.study import LOOKS, Axis, Band, Bars, Diagram, Look, Numbers, Parallel, Points, Progress, Study, wrapped
from .charts import axes_layout, encoded, plain

AXIS = "#8b95a3"  # of parallel coordinates, on light and on dark pages
LETTERS, LINE = 15, 15  # of a label, in a line; pixels that a line takes
BAR, REST = 34, 120  # pixels: of a bar, of what is round them
NAME = 26  # likewise of a bar or a point, as `wrapped` counts
ROOM = 0.4  # of the axis, beside the longest bars: for their numbers
Trace = dict[str, Any]


@dataclass
class DrawnDiagram:
    """One chart of the page; `height` in pixels where it has one of its own.

    `shape`: "broad" over the whole width, "long" on paper alone, where names leave no room for bars.
    """

    name: str
    traces: list[Trace]
    layout: dict[str, Any]
    shape: Literal["", "broad", "long"] = ""
    height: int | None = None


def drawn(diagram: Diagram, name: str) -> DrawnDiagram:
    """Under a `name` that is unique on the page."""
    match diagram:
        case Bars():
            return _bars(diagram, name)
        case Parallel():
            return _parallel(diagram, name)
        case Progress():
            of_search = axes_layout(diagram.title, "design, in the order of the search", diagram.y_label)
            of_search["yaxis"] |= {"type": "log"} if diagram.logarithmic else {}
            return DrawnDiagram(name, list(_progress(diagram)), of_search)
        case Band():
            return DrawnDiagram(name, list(_band(diagram)), axes_layout(diagram.title, "time (s)", diagram.y_label))
        case Points():
            of_points = axes_layout(diagram.title, diagram.x_label, diagram.y_label, legend=False)
            return DrawnDiagram(name, [_points(diagram)], of_points)


def _bars(diagram: Bars, name: str) -> DrawnDiagram:
    """The first label on top, a color for each series, of a signed one for each sign."""
    traces, names = [], [_broken(label, NAME) for label in diagram.labels]
    form = "+.3g" if diagram.signed else ".3g"
    for k, series in enumerate(diagram.series):
        values = [value or 0.0 for value in series.values]
        traces.append({
            "type": "bar", "orientation": "h", "name": plain(series.label), "x": values,
            "y": names, "text": [f"{value:{form}}" for value in values],
            "textposition": "none" if series.errors else "outside",  # where they would lie on the errors
            "marker": {"color": [COLORS[1] if diagram.signed and value < 0.0 else COLORS[k] for value in values]},
            "hovertemplate": "%{y}: %{x:.5g}<extra></extra>",
        })  # fmt: skip
        if series.errors:
            traces[-1]["error_x"] = {"type": "data", "array": list(series.errors), "thickness": 1, "color": AXIS}
    look = axes_layout(diagram.title, diagram.x_label, "", legend=len(traces) > 1)
    look |= {"bargap": 0.25, "barmode": "group"}
    values = [0.0, *(value or 0.0 for series in diagram.series for value in series.values)]
    low, high = min(values), max(values)
    room = ROOM * (high - low)
    look["xaxis"] |= {"autorangeoptions": {"include": [low - room * (low < 0.0), high + room * (high > 0.0)]}}
    look["yaxis"] |= {"autorange": "reversed", "type": "category"}
    of_name = max(BAR * len(traces), LINE * max((text.count("<br>") + 1 for text in names), default=0))
    return DrawnDiagram(name, traces, look, "long", REST + of_name * len(names))


def _parallel(diagram: Parallel, name: str) -> DrawnDiagram:
    """A trace for each state, so that the legend shows and hides it; axes are shapes and their texts annotations."""
    places = np.column_stack([axis.places for axis in diagram.axes])
    traces = []
    for state, look in LOOKS.items():
        rows = [k for k, one in enumerate(diagram.states) if one == state]
        if rows:
            label = diagram.best_label if state == "best" else look.label
            traces.append(_lines(diagram, places, rows, look, label))
    limits = [(k, axis) for k, axis in enumerate(diagram.axes) if axis.limit is not None]
    if limits:
        traces.append(_limits(limits))
    axes = [
        {"type": "line", "x0": k, "x1": k, "y0": 0, "y1": 1, "layer": "below", "line": {"color": AXIS, "width": 1.5}}
        for k in range(len(diagram.axes))
    ]
    lines = max(len(wrapped(axis.label, LETTERS)) for axis in diagram.axes)
    hidden = {"visible": False, "fixedrange": True}
    layout = {
        "title": {"text": plain(diagram.title)}, "shapes": axes,
        "annotations": [text for k, axis in enumerate(diagram.axes) for text in _texts(k, axis)],
        "xaxis": hidden | {"range": [-0.4, len(diagram.axes) - 0.6]}, "yaxis": hidden | {"range": [-0.04, 1.04]},
        "margin": {"l": 40, "r": 40, "t": 50 + LINE * lines, "b": 30}, "showlegend": True,
        "legend": {"orientation": "h", "y": -0.06},
    }  # fmt: skip
    return DrawnDiagram(name, traces, layout, "broad")


def _lines(diagram: Parallel, places: Array, rows: list[int], look: Look, label: str) -> Trace:
    """Designs one after the other with gaps between them; what a design has is told where it meets an axis."""
    x: list[float | None] = []
    y: list[float | None] = []
    texts: list[str] = []
    for row in rows:
        known = np.flatnonzero(np.isfinite(places[row]))
        x += [*map(float, known), None]
        y += [*map(float, places[row, known]), None]
        texts += [f"{diagram.designs[row]}: {_value_text(diagram.axes[k], row)}" for k in known] + [""]
    dash, marker = look.plotly
    return {
        "type": "scatter", "mode": "lines+markers", "name": plain(label), "x": x, "y": y, "text": texts,
        "hovertemplate": "%{text}<extra></extra>",
        "line": {"color": look.color, "width": 1.2 * look.width, "dash": dash},
        "marker": {"size": 4 if look.width < 2 else 7, "symbol": marker, "color": look.color},
        "opacity": 0.55 if look.width < 2 and len(rows) > 30 else 1.0,
    }  # fmt: skip


def _value_text(axis: Axis, row: int) -> str:
    value = axis.values[row]
    text = "" if value is None else axis.names[round(value)] if axis.names else f"{value:.6g}"
    return plain(f"{axis.label} = {text}")


def _limits(limits: list[tuple[int, Axis]]) -> Trace:
    return {
        "type": "scatter", "mode": "markers", "name": "limit, pointing beyond it",
        "x": [k for k, _ in limits], "y": [float(axis.place(np.array(axis.limit))) for _, axis in limits],
        "text": [plain(f"limit of {axis.label}: {axis.limit:.6g}") for _, axis in limits],
        "hovertemplate": "%{text}<extra></extra>",
        "marker": {
            "symbol": ["triangle-up" if axis.sense > 0 else "triangle-down" for _, axis in limits], "size": 13,
            "color": COLORS[3], "line": {"color": AXIS, "width": 1},
        },
    }  # fmt: skip


def _texts(k: int, axis: Axis) -> Iterator[dict[str, Any]]:
    name = _broken(axis.label, LETTERS)
    yield {"x": k, "y": 1.03, "text": name, "showarrow": False, "yanchor": "bottom", "font": {"size": 11}}
    look = {"showarrow": False, "xanchor": "right", "font": {"size": 10}}
    yield from ({"x": k, "y": place, "text": f"{plain(text)} –", **look} for place, text in axis.ticks)


def _broken(label: str, letters: int) -> str:
    """In lines of about so many letters."""
    return "<br>".join(plain(line) for line in wrapped(label, letters))


def _progress(diagram: Progress) -> Iterator[Trace]:
    numbers = list(range(len(diagram.values)))
    yield {
        "type": "scatter", "mode": "lines", "name": "best so far", "x": numbers, "y": list(diagram.best),
        "line": {"color": COLORS[0], "shape": "hv"},
    }  # fmt: skip
    lowest = min((value for value in diagram.values if value is not None), default=1.0)
    for state, look in LOOKS.items():
        mine = [k for k in numbers if diagram.states[k] == state]
        if mine:
            values: Numbers = tuple(diagram.values[k] if state != "failed" else lowest for k in mine)
            yield {
                "type": "scatter", "mode": "markers", "name": plain(look.label), "x": mine, "y": list(values),
                "marker": {"color": look.color, "symbol": look.plotly[1], "size": 8},
                "hovertemplate": "design %{x}: " + ("failed" if state == "failed" else "%{y:.6g}") + "<extra></extra>",
            }  # fmt: skip


def _band(band: Band) -> Iterator[Trace]:
    """Bands as pairs of lines without width, the second filled to the first."""
    time = np.array(band.time)
    for low, high, label, color in (
        (band.lowest, band.highest, band.worst_label, "rgba(230, 159, 0, 0.3)"),
        (band.low, band.high, band.band_label, "rgba(86, 180, 233, 0.6)"),
    ):
        edge = {"type": "scatter", "mode": "lines", "line": {"width": 0}, "legendgroup": label}
        edge |= {"x": encoded(time, "f8")}
        yield edge | {"y": encoded(np.array(low)), "showlegend": False, "name": f"{plain(label)}: lower end"}
        yield edge | {"y": encoded(np.array(high)), "fill": "tonexty", "fillcolor": color, "name": plain(label)}
    for values, label, line in (
        (band.median, "median", {"color": COLORS[1]}),
        (band.nominal, "nominal values", {"color": AXIS, "dash": "dot"}),
    ):
        yield {
            "type": "scatter", "mode": "lines", "name": label, "x": encoded(time, "f8"),
            "y": encoded(np.array(values)), "line": line | {"simplify": False},
        }  # fmt: skip


def _points(diagram: Points) -> Trace:
    sure = diagram.sure or (True,) * len(diagram.x)
    mode = "+".join(["lines"] * diagram.joined + ["markers"])
    trace: Trace = {
        "type": "scatter", "mode": mode, "x": list(diagram.x), "y": list(diagram.y),
        "text": [_broken(label, NAME) for label in diagram.labels],
        "hovertemplate": "%{text}<br>%{x:.6g}, %{y:.6g}<extra></extra>", "cliponaxis": False,
        "line": {"color": COLORS[0]},
        "marker": {"size": 8, "color": COLORS[0], "symbol": ["circle" if one else "circle-open" for one in sure]},
    }  # fmt: skip
    return trace


@dataclass(frozen=True)
class StudyPart:
    """One study on the page; `file` it was read from."""

    number: int
    file: Path
    study: Study

    @property
    def title(self) -> str:
        """What was asked, and of which scene."""
        return f"{self.study.title}: {self.study.scene_name}"

    @property
    def mood(self) -> str:
        """For the color of its headline."""
        return {True: "good", False: "bad", None: ""}[self.study.good]

    @property
    def charts(self) -> list[DrawnDiagram]:
        """Its diagrams."""
        return [drawn(one, f"study_{self.number}_{one.name}") for one in self.study.diagrams]
