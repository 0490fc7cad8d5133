"""Diagrams of a study as figures, of files and of the page of a report."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import Locator, LogLocator, MaxNLocator

from ...common.arrays import Array
from ..figures.plot import image_of, write_figure
from ..figures.style import legend, literal, new_axes, style
from ..projection import COLORS
from .study import LOOKS, Band, Bars, DesignAxis, Diagram, Look, Parallel, Points, Progress, floats, wrapped


def write_diagrams(diagrams: Sequence[Diagram], folder: Path) -> list[Path]:
    """Write a figure of each diagram as PNG and PDF into `folder`; returns the files."""
    with style():
        return [path for one in diagrams for path in write_figure(literal(draw(one)), folder, one.name)]


def svg_of(diagram: Diagram) -> bytes:
    """Return the figure of a diagram as an SVG file."""
    with style():
        return image_of(literal(draw(diagram)), "svg")


def draw(diagram: Diagram) -> Figure:
    """Return the figure of a diagram."""
    match diagram:
        case Bars():
            return _draw_bars(diagram)
        case Parallel():
            return _draw_parallel(diagram)
    figure, axes = new_axes(diagram.title)
    axes.set_ylabel(diagram.y_label)
    match diagram:
        case Band():
            _draw_band(axes, diagram)
        case Progress():
            _draw_progress(axes, diagram)
        case Points():
            _draw_points(axes, diagram)
    legend(axes)
    return figure


MOST = 15  # the largest
WIDTH, BAR, REST = 5.0, 0.22, 0.8  # inches: of the figure, of a bar, of title and axis


def _draw_bars(diagram: Bars) -> Figure:
    labels, count = diagram.labels[:MOST], len(diagram.series)
    rows = max(1, len(labels)) * (1 if count == 1 else 0.8 * count)
    picture = Figure(figsize=(WIDTH, REST + BAR * (rows + (count > 1))), layout="constrained")
    axes = picture.subplots()
    axes.set_title(diagram.title, loc="right")  # which has room on the left, above and below the names
    height = 0.8 / count
    for k, series in enumerate(diagram.series):
        at = np.arange(len(labels)) + (k - 0.5 * (count - 1)) * height
        values = [value or 0.0 for value in series.values[:MOST]]
        bars = axes.barh(
            at,
            values,
            height,
            xerr=list(series.errors[:MOST]) or None,
            color=[COLORS[1] if diagram.signed and value < 0.0 else COLORS[k] for value in values],
            label=series.label or None,
            error_kw={"elinewidth": 0.7, "capsize": 1.5},
        )
        numbers = [_number(value, "+" if diagram.signed else "") for value in series.values[:MOST]]
        axes.bar_label(bars, numbers, padding=2, fontsize=7)
    axes.margins(x=0.2)  # for the numbers of the longest bars
    axes.locator_params(axis="x", nbins=7)
    axes.set_yticks(range(len(labels)), labels)
    axes.tick_params(axis="y", length=0)
    axes.invert_yaxis()
    axes.grid(visible=False, axis="y")
    axes.set_axisbelow(True)
    axes.axvline(0.0, color="black", linewidth=0.6)
    axes.set_xlabel(diagram.x_label, loc="right")
    legend(axes)
    return picture


def _number(value: float | None, sign: str) -> str:
    return "none" if value is None else f"{value:{sign}.3g}".replace("-", "−") if value else "0"


def _draw_band(axes: Axes, band: Band) -> None:
    for low, high, color, alpha, label in (
        (band.lowest, band.highest, COLORS[5], 0.3, band.worst_label),
        (band.low, band.high, COLORS[4], 0.7, band.band_label),
    ):
        axes.fill_between(band.time, low, high, color=color, alpha=alpha, linewidth=0.0, label=label)
    axes.plot(band.time, band.median, color=COLORS[1], label="median")
    axes.plot(band.time, band.nominal, color=COLORS[6], linestyle=":", label="nominal values")
    axes.set_xlabel("time (s)")
    axes.margins(x=0.0)


def _draw_progress(axes: Axes, diagram: Progress) -> None:
    values, states = floats(diagram.values), np.array(diagram.states)
    number = np.arange(len(values))
    axes.plot(number, floats(diagram.best), color=COLORS[0], drawstyle="steps-post", label="best so far")
    for state, look in LOOKS.items():
        mine = states == state
        marks: dict[str, Any] = {"color": look.color, "label": look.label}
        if state == "failed" and mine.any():  # at the lower edge
            edge = np.full(mine.sum(), 0.02)
            axes.plot(number[mine], edge, look.marker, transform=axes.get_xaxis_transform(), **marks)
        elif mine.any():
            axes.plot(number[mine], values[mine], look.marker, zorder=3, **marks)
    if diagram.logarithmic:
        axes.set_yscale("log")
    axes.xaxis.set_major_locator(MaxNLocator(6, integer=True))
    axes.set_xlabel("design, in the order of the search")


def _draw_points(axes: Axes, diagram: Points) -> None:
    x, y = np.array(diagram.x), np.array(diagram.y)
    sure = np.array(diagram.sure, dtype=bool)
    axes.plot(x, y, color=COLORS[0])
    axes.plot(x[sure], y[sure], "o", color=COLORS[0])
    axes.plot(x[~sure], y[~sure], "o", color=COLORS[0], markerfacecolor="white")
    axes.set_xlabel(diagram.x_label)


AXIS_WIDTH, HEIGHT = 1.25, 3.4  # inches: of an axis, of the figure
LETTERS, LINE = 18, 9  # of a name, in a line; points that a line takes


def _draw_parallel(diagram: Parallel) -> Figure:
    count = len(diagram.axes)
    figure = Figure(figsize=(max(3.5, AXIS_WIDTH * (count + 0.3)), HEIGHT), layout="constrained")
    axes = figure.subplots()
    lines = max(len(wrapped(axis.label, LETTERS)) for axis in diagram.axes)
    axes.set_title(diagram.title, loc="left", pad=8 + LINE * lines)
    axes.set_axis_off()
    axes.set(xlim=(-0.35, count - 0.75), ylim=(-0.03, 1.03))
    places = np.column_stack([axis.places for axis in diagram.axes])
    for state, look in LOOKS.items():
        for row in (k for k, one in enumerate(diagram.states) if one == state):
            _line(axes, places[row], look, 0.35 if state == "kept" and len(places) > 30 else 1.0)
    for k, axis in enumerate(diagram.axes):
        _axis(axes, k, axis)
    labels = {state: look.label for state, look in LOOKS.items()} | {"best": diagram.best_label}
    samples = [
        Line2D([], [], color=look.color, linestyle=look.dash, linewidth=look.width, label=labels[state])
        for state, look in LOOKS.items()
        if state in diagram.states
    ]
    if any(axis.limit is not None for axis in diagram.axes):
        samples.append(Line2D([], [], linewidth=1.6, label="limit, pointing beyond it", **_beyond(1)))
    figure.legend(handles=samples, loc="outside lower center", ncols=len(samples))
    return figure


def _line(axes: Axes, places: Array, look: Look, opacity: float) -> None:
    """As far as its values are known, with a mark where they end."""
    known = np.isfinite(places)
    x = np.flatnonzero(known)
    axes.plot(x, places[known], look.dash, color=look.color, linewidth=look.width, alpha=opacity, clip_on=False)
    if not known.all() and x.size:
        axes.plot(x[-1], places[x[-1]], look.marker, color=look.color, markersize=4)


def _axis(axes: Axes, k: int, axis: DesignAxis) -> None:
    """A vertical line with ticks at its left and its name above; a limit as a mark to the side that is forbidden."""
    axes.plot([k, k], [0.0, 1.0], color="black", linewidth=0.8, clip_on=False)
    for value, text in _ticks(axis):
        place = float(axis.place(np.array(value)))
        axes.plot([k - 0.02, k], [place, place], color="black", linewidth=0.6, clip_on=False)
        box = {"facecolor": "white", "alpha": 0.7, "linewidth": 0.0, "pad": 0.5}
        axes.text(k - 0.035, place, text, ha="right", va="center", fontsize=6, bbox=box)
    axes.text(k, 1.05, "\n".join(wrapped(axis.label, LETTERS)), ha="center", va="bottom", fontsize=7)
    if axis.limit is not None:
        place = float(axis.place(np.array(axis.limit)))
        axes.plot([k, k + 0.1], [place, place], color="black", linewidth=1.6)
        axes.plot(k + 0.1, place, **_beyond(axis.sense))


def _ticks(axis: DesignAxis) -> list[tuple[float, str]]:
    """Round numbers within the axis, or the rows of a catalog, and their texts."""
    if axis.names:
        return [(float(k), name) for k, name in enumerate(axis.names)]
    low, high = axis.low, axis.high
    locators: list[Locator] = [MaxNLocator(7, steps=[1, 2, 5, 10])]  # intervals of an axis at most
    if axis.logarithmic:
        locators.insert(0, LogLocator(subs=[1.0] if high > 1e3 * low else [1.0, 2.0, 5.0]))
    room = 1e-9 * (high - low)
    for locator in locators:
        inside = [x for x in locator.tick_values(low, high) if low - room <= x <= high + room]
        if len(inside) > 1:
            return [(float(x), f"{x:.6g}") for x in inside]
    return []


def _beyond(sense: int) -> dict[str, Any]:
    return {"marker": "^" if sense > 0 else "v", "color": "black", "markersize": 4}
